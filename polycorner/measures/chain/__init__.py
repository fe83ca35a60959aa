"""The compiled chain that samples strata."""
