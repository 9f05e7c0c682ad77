"""Entry point of the Blender extension: hands over to `seip_addon` when Blender registers it."""


def register() -> None:
    """Register the add-on's classes and properties."""
    from . import seip_addon  # noqa: PLC0415  # lazy, so that a checkout can be imported by any tool

    seip_addon.register()


def unregister() -> None:
    """Remove everything that `register` added."""
    from . import seip_addon  # noqa: PLC0415  # as above

    seip_addon.unregister()
