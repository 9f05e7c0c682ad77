"""Cost and gain of alternative settings of the detector."""
