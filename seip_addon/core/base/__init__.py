"""What all of the core stands on: errors, limits, arrays, settings, progress and estimates."""
