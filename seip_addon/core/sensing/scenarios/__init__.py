"""Visibility under pose errors and in traffic: the scenarios that placements are optimised over and evaluated on."""
