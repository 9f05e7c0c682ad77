"""Limits of the detector: disturbances, trials, charts."""
