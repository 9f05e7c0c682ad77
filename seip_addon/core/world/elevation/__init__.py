"""Heights of the ground from elevation models."""
