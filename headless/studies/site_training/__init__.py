"""Training of the detector on several sites, with a random placement for each run of traffic."""
