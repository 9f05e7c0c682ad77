"""Charts of robust placement and of placement in traffic."""
