"""Recordings of real sensors: sweeps, times, poses and labels, read from the formats of the field."""
