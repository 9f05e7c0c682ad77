"""Viewport overlays, which are no part of the scene."""
