"""Open benchmark of placement criteria: ten junctions, placements on each, and what a detector finds with them."""
