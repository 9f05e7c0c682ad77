"""Sensor placement: the maximal covering location problem, solved with a bound on the optimum."""
