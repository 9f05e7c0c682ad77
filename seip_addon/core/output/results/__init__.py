"""Result files: placement record, tables, CARLA spawns."""
