"""The core: NumPy in, NumPy out, no Blender."""
