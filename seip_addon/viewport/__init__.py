"""What is drawn into the viewport and stays no part of the scene."""
