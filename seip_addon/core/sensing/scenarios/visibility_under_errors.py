"""Visibility grids of poses under draws of pose errors."""

from collections.abc import Generator

import numpy as np

from ...arrays import Integer
from ...progress import Progress
from ..visibility.chunks import sharing_rays
from ..visibility.ray_casting import engine_name, make_ray_caster
from ..visibility.surroundings import Surroundings
from ..visibility.visibility_model import VisibilityModel
from .pose_errors import PoseDraws, PoseErrors, draw_errors, out_of_objects
from .scenario_visibility import ScenarioVisibility, each_in_threads


def draws_for(around: Surroundings, poses: Integer, errors: PoseErrors, draws: int, seed: int) -> PoseDraws:
    """Draw errors of some of a site's poses that put no sensor inside an object; see `out_of_objects`."""
    candidates = around.site.candidates
    drawn = draw_errors(errors, candidates.position[candidates.position_of[poses]], draws, seed)
    return out_of_objects(drawn, candidates.xyz[poses], around.objects)


def visibility_under_errors(
    around: Surroundings, poses: Integer, draws: PoseDraws
) -> Generator[Progress, None, ScenarioVisibility]:
    """Compute visibility from poses under draws of errors; sensors of several types at one position share rays.

    Parameters
    ----------
    poses : (s,) int64
        Indices among the site's candidates.
    draws : PoseDraws
        Errors of these poses in n draws; poses at one position must have equal errors.

    Yields
    ------
    Progress
        Progress after each position of a draw.
    """
    site, models = around.site, around.models
    candidates = site.candidates
    keys, xyz = candidates.sensor[poses].tolist(), candidates.xyz[poses]
    yaw, tilt = candidates.yaw[poses], candidates.tilt[poses]
    caster = make_ray_caster(site.triangles, engine_name(around.engine))
    model = VisibilityModel(site.targets.xyz, site.reflectivity, around.sight, caster)
    together = sharing_rays(xyz, yaw, tilt)
    packed = np.zeros((len(draws), len(poses), (len(site.targets) + 7) // 8), dtype=np.uint8)
    orientations = draws.orientations(yaw, tilt)

    def compute(work: tuple[int, Integer]) -> None:
        draw, members = work
        first = members[0]
        where, rotated = xyz[first] + draws.shift[draw, first], orientations[draw, first]
        seen, _ = model.see_all([models[keys[member]] for member in members], where, rotated)
        packed[draw, members] = np.packbits(seen, axis=1)

    works = [(draw, members) for draw in range(len(draws)) for members in together]
    yield from each_in_threads(compute, works, caster.threads, "computing visibility under pose errors")
    return ScenarioVisibility(packed, len(site.targets))
