"""Visibility grids of poses under draws of pose errors."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Integer
from ..lidar import LidarModel
from ..progress import Progress
from ..site.scene_geometry import Mesh
from ..site.site import Site
from ..visibility.grid import VisibilitySettings
from ..visibility.observer import places
from ..visibility.ray_casting import Engine, engine_name, make_ray_caster
from ..visibility.rotated_sensors import Onlooker
from .pose_errors import PoseDraws, PoseErrors, draw_errors, out_of_objects
from .scenario_visibility import ScenarioVisibility, each_in_threads


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Where sensors may hang, and what they see there.

    Parameters
    ----------
    models : mapping of str to LidarModel
        At least those that the candidates name.
    objects : sequence of Mesh
        Nothing hangs inside these: the scene's occluders.
    engine : {"auto", "bvh", "embree"}
    """

    site: Site
    models: Mapping[str, LidarModel]
    sight: VisibilitySettings
    objects: Sequence[Mesh] = ()
    engine: Engine = "auto"


def draws_for(
    around: Surroundings, poses: Integer, errors: PoseErrors, draws: int, seed: int
) -> tuple[PoseDraws, Boolean]:
    """Draw errors of some of a site's poses, none of which ends inside an object; see `out_of_objects`."""
    candidates = around.site.candidates
    drawn = draw_errors(errors, candidates.position[candidates.position_of[poses]], draws, seed)
    return out_of_objects(drawn, candidates.xyz[poses], around.objects)


def visibility_under_errors(
    around: Surroundings, poses: Integer, draws: PoseDraws
) -> Generator[Progress, None, ScenarioVisibility]:
    """Look from poses as draws of errors leave them; sensors of several types at one place share rays.

    Parameters
    ----------
    poses : (s,) int64
        Among the site's candidates.
    draws : PoseDraws
        Of n draws for these poses; poses of one place must err alike.

    Yields
    ------
    Progress
        After each place of a draw.
    """
    site, models = around.site, around.models
    candidates = site.candidates
    keys, xyz = candidates.sensor[poses].tolist(), candidates.xyz[poses]
    yaw, tilt = candidates.yaw[poses], candidates.tilt[poses]
    caster = make_ray_caster(site.triangles, engine_name(around.engine))
    onlooker = Onlooker(site, around.sight, caster)
    together = places(xyz, yaw, tilt)
    packed = np.zeros((len(draws), len(poses), (len(site.targets) + 7) // 8), dtype=np.uint8)
    orientations = draws.orientations(yaw, tilt)

    def look(work: tuple[int, Integer]) -> None:
        draw, members = work
        first = members[0]
        where, turned = xyz[first] + draws.shift[draw, first], orientations[draw, first]
        seen = onlooker.see_all([models[keys[member]] for member in members], where, turned)
        packed[draw, members] = np.packbits(seen, axis=1)

    works = [(draw, members) for draw in range(len(draws)) for members in together]
    yield from each_in_threads(look, works, caster.threads, "looking from poses as they may be")
    return ScenarioVisibility(packed, len(site.targets))
