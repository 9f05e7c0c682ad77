"""Scans and their labels as datasets, in the formats that the field's trainers and viewers read."""
