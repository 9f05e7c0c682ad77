"""Where the detector fails: disturbances, trials, charts."""
