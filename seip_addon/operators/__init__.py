"""Operators: each a thin way from a click, or a script, to the core and back into the scene."""
