"""SEIP for Blender: where to put how many roadside sensors."""


def register() -> None:
    """Register the add-on with Blender; the batch commands need only its packages and wheels."""


def unregister() -> None:
    """Remove everything that `register` added."""
