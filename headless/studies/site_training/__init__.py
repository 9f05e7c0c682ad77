"""Training of the detector on several sites, with a placement of its own for each run."""
