"""Heights of the ground, and what stands on it, from elevation models and laser surveys."""
