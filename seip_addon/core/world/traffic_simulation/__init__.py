"""Traffic simulation with Eclipse SUMO: demand on a map's streets, signals, and the run."""
