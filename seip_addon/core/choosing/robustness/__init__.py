"""Robustness of placements to pose errors, sensor failures and traffic, and robust optimisation."""
