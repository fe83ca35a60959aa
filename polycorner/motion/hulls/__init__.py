"""Contacts of sharp hulls: compiled gaps and slips that choose what separates two of them."""
