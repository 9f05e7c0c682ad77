"""Other programs that the core starts: SUMO, child processes."""
