"""Plans, labelled views and charts, drawn with matplotlib."""
