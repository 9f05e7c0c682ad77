"""The site as read from a scene: region of interest, targets, candidates, obstructions, checks."""
