"""Batch commands: thin scripts over the same functions that the add-on calls."""
