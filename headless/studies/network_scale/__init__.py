"""Cost of the sites of a network, and simulated schedules of larger ones."""
