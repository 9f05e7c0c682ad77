"""Operators: thin wrappers of core functions."""
