"""What LiDARs measure: models of sensors, visibility of targets, returns from road users, traffic and scans of it."""
