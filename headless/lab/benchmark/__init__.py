"""What the benchmark measures: visibility, placement, and how both grow."""
