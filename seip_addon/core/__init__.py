"""The core: NumPy arrays in and out, no Blender."""
