"""SEIP for Blender: where to put how many roadside sensors."""


def register() -> None:
    """Register the add-on with Blender; the batch commands need only its packages and wheels."""
    from . import registration  # noqa: PLC0415  # lazy: the core runs where there is no Blender

    registration.register()


def unregister() -> None:
    """Remove everything that `register` added."""
    from . import registration  # noqa: PLC0415  # as above

    registration.unregister()
