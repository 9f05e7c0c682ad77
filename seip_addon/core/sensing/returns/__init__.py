"""Expected returns of LiDARs from road users: bodies, positions, and the grid of poses × road users."""
