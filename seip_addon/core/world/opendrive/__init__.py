"""OpenDRIVE maps: roads, lane surfaces, objects and signals in map coordinates."""
