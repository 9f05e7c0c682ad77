"""What was chosen and what it sees: the deployment, its record, table and CARLA spawns."""
