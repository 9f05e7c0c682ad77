"""Road users: their trajectories, and their bodies as a LiDAR sees them."""
