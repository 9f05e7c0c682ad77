"""Limits of visibility, placement and arithmetic, chapter by chapter."""
