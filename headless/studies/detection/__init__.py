"""Detection study: average precision of sensor types and numbers against price and coverage, and the paper's claims."""
