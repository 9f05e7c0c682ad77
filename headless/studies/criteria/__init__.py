"""Criteria of placements and how well they predict detection, for placements of one type and number.

`pose_criteria` holds criteria as functions of sets of poses, those of the literature among them; `site_criteria`
computes them for a survey from `voxels` and `vehicle_grid`, and finds the placement that each rates best. `drawing`
draws others, and `criteria_table` compares the criteria over sites, types and counts by average precision.
"""
