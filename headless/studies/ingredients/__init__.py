"""Gain of each ingredient of a training for unseen sites: variants, training sites, tests, table and chart."""
