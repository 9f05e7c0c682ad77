"""Arrays in, arrays out: everything that needs no Blender."""
