"""Sensors at many sites within one budget: frontier of each site, allocation, and bounds on both."""
