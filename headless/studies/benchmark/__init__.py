"""Benchmark of visibility, placement and scans."""
