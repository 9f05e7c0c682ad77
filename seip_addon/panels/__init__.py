"""Panels of the sidebar, in the order of the work; each says what is missing before its button works."""
