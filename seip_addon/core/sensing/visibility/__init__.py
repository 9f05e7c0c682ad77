"""Visibility of targets from candidates, by ray casting with culling."""
