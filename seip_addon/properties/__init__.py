"""Properties of scenes, by feature: settings of the panel, and results kept in the file."""
