"""Whole jobs, as the panel and the commands run them: survey, robust placement, placement by hand, recording."""
