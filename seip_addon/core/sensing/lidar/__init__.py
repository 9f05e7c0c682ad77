"""LiDAR models: beams, price, returns and noise.

Visibility and scans share the law by which returns are detected. Noise and lost returns belong to scans and are seeded.
"""
