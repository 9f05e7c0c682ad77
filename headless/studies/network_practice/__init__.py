"""Allocation of a budget over a network against common practice."""
