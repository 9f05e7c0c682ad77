"""Where visibility, placement and arithmetic fail, chapter by chapter."""
