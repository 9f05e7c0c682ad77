"""State of the add-on beside the scene: the session of the open file, its status, and sensors that are followed."""
