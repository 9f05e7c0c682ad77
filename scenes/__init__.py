"""The shipped scenes: maps and site descriptions, and the generator that writes the maps."""
