"""Cost and gain of other settings of the detector."""
