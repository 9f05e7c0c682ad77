"""Whole jobs shared by panel and commands: survey, robust placement, traffic, recording."""
