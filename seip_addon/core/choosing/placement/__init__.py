"""Sensor placement: a sum of concave values of targets, with the best placement found and a bound on all."""
