"""Plane and solid geometry: orientations, polygons in plan, winding numbers."""
