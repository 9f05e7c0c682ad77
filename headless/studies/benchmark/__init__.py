"""Benchmark of visibility and placement, and of their growth."""
