"""Choice of sensors: criterion, constraints, bounds and search; robustness to pose errors, failures and traffic."""
