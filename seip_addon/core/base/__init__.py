"""Errors, limits, arrays, settings, progress and estimates, on which all of the core stands."""
