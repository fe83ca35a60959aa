"""Nonsmooth dynamics: bodies that touch, rub, roll, rest and move again."""
