"""Inputs of visibility from poses that are not candidates of a site."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...site.scene_geometry import Mesh
from ...site.site import Site
from ..lidar.model import LidarModel
from .settings import Engine, VisibilitySettings


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A site with its sensor models, visibility settings and obstacles, for visibility from changed poses.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.
    objects : sequence of Mesh
        The scene's occluders, which must not contain a sensor.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    """

    site: Site
    models: Mapping[str, LidarModel]
    sight: VisibilitySettings
    objects: Sequence[Mesh] = ()
    engine: Engine = "auto"
