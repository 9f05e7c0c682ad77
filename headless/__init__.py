"""Batch commands: command lines over the functions that the add-on calls."""
