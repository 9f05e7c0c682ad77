"""Scans of traffic: the points that all sensors measure at one instant, and the boxes of that instant."""
