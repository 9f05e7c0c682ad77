"""State of the add-on beside the scene: the session of the open file, and what it follows from."""
