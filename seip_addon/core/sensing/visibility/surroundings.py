"""A site with all that visibility from other poses than its candidates needs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...site.scene_geometry import Mesh
from ...site.site import Site
from ..lidar.model import LidarModel
from .ray_casting import Engine
from .settings import VisibilitySettings


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A site with its sensor models, visibility settings and obstacles, for visibility from changed poses.

    Parameters
    ----------
    models : mapping of str to LidarModel
        At least those that the candidates name.
    objects : sequence of Mesh
        The scene's occluders: no sensor is inside one.
    engine : {"auto", "bvh", "embree"}
    """

    site: Site
    models: Mapping[str, LidarModel]
    sight: VisibilitySettings
    objects: Sequence[Mesh] = ()
    engine: Engine = "auto"
