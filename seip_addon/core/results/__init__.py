"""What a run leaves on disk of its result: record, tables, CARLA spawns."""
