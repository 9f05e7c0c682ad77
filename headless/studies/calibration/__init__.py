"""Comparison of LiDAR models with measured sweeps."""
