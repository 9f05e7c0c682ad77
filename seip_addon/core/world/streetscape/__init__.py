"""From a map and a site description to a model of a street: surfaces, furniture, roles; no Blender."""
