"""A bird's-eye plan of a placement, as a picture."""

from __future__ import annotations

import os

from .deployment import Deployment
from .scene_geometry import SceneGeometry
from .site import Site


def save_plan_view(path: str | os.PathLike[str], geometry: SceneGeometry, site: Site, deployment: Deployment) -> None:
    """Draw the site with its candidates, the chosen sensors and what they see, as PNG."""
    raise NotImplementedError
