"""The only bridge between Blender's scene and the core."""
