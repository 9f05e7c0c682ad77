"""Criteria of placements and how well they predict detection, for placements of one type and number.

`drawing` draws them, `precision` evaluates detectors with each, `criteria` computes how good each is by coverage and by
other criteria, `agreement` how well these agree with average precision, and `results` writes it down.

`pose_criteria` holds criteria as functions of sets of poses, those of the literature among them; `site_criteria`
computes them for a survey from `voxels` and `vehicle_grid`, and finds the placement that each rates best. With
`shared_scans` many placements are evaluated in one go, and `criteria_table` compares the criteria over sites, types and
counts.
"""
