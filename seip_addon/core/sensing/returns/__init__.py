"""Expected returns of LiDARs on road users: bodies, where they stand, and the grid of poses × road users."""
