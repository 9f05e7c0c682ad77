"""Panels of the sidebar, in the order of the workflow."""
