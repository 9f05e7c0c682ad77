"""Other programs and clusters that the core starts: SUMO, child processes, Dask."""
