"""What placements lose to pose errors, failures and traffic, and placements that lose less."""
