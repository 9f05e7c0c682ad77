"""The result in the scene: sensors as empties, coverage as coloured squares on the road."""

from __future__ import annotations

import bpy

from ..core.deployment import Deployment
from ..core.site import Site


def write_result(scene: bpy.types.Scene, site: Site, deployment: Deployment) -> None:
    """Put the chosen sensors and the coverage into the scene, in place of an earlier result."""
    raise NotImplementedError
