"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import os

import bpy

from ..core.deployment import Deployment
from ..core.site import Site


def save_rendered_view(path: str | os.PathLike[str], scene: bpy.types.Scene, site: Site, deployment: Deployment) -> None:
    """Render the scene from an oblique angle in the south-west and label the sensors, as PNG."""
    raise NotImplementedError
