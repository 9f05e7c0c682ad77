"""Whole jobs that the panel and the commands share: survey, robust placement, recording."""
