"""Simplified scenes and sensors, and what they cost in accuracy: fewer rays, channels or targets, simpler objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry, ordered_surfaces
from seip_addon.core.site.site import Site, make_site

SITE_SENSORS = 4
"""Number of sensors that are placed at the scene's site."""

EXACT = "none"
"""Name of the exact grid among the simplifications."""


@dataclass(frozen=True, eq=False)
class Simplification:
    """A simplified site and simplified sensor types, with the candidate poses of the exact site.

    Parameters
    ----------
    nearest_target : (t,) int64
        Index of the target of ``site`` that is nearest to each target of the exact site.
    """

    name: str
    site: Site
    models: Mapping[str, LidarModel]
    nearest_target: Integer


@dataclass(frozen=True)
class Degradation:
    """Error of a simplified grid, and of the placement optimised on it.

    Parameters
    ----------
    wrong : float
        Wrong pairs of pose and target, per pair that is visible in the exact grid.
    claimed, coverage : float
        Coverage of the placement (share of targets) by the simplified grid and by the exact one.
    kept : int
        Number of its poses that the placement on the exact grid has as well.
    proven : bool
        Whether the placement is proven optimal on its grid; otherwise the effort was too small.
    """

    wrong: float
    claimed: float
    coverage: float
    kept: int
    proven: bool


def simplifications(
    geometry: SceneGeometry, site: Site, models: Mapping[str, LidarModel], layout: CandidateSettings
) -> list[Simplification]:
    """Return sites with fewer azimuth steps, fewer channels, coarser grids and simpler objects."""
    same = np.arange(len(site.targets))

    def with_models(name: str, change: Callable[[LidarModel], LidarModel]) -> Simplification:
        return Simplification(name, site, {key: change(model) for key, model in models.items()}, same)

    def with_grid(factor: int) -> Simplification:
        spacing = factor * site.targets.spacing
        coarse = make_site(geometry, layout, spacing, fields_of_view=fields_of_view(models))
        offset = site.targets.xyz[:, None, :2] - coarse.targets.xyz[None, :, :2]
        return Simplification(f"grid of {spacing:g} m", coarse, models, (offset**2).sum(axis=2).argmin(axis=1))

    def with_objects(name: str, change: Callable[[Mesh], Float]) -> Simplification:
        objects = [Mesh(mesh.name, change(mesh)) for mesh in geometry.occluders]
        triangles, reflectivity = ordered_surfaces([*geometry.roads, *geometry.ground, *objects])
        return Simplification(name, replace(site, triangles=triangles, reflectivity=reflectivity), models, same)

    return [
        *(with_models(f"azimuth ÷ {n}", partial(every_nth_azimuth, n=n)) for n in (2, 4, 8)),
        with_models("channels ÷ 2", every_other_channel),
        *(with_grid(factor) for factor in (2, 4)),
        with_objects("objects as boxes", bounding_box),
        with_objects("objects decimated", decimated),
    ]


def degradations(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    simpler: Sequence[Simplification],
    effort: float,
) -> dict[str, Degradation]:
    """Measure the error of each simplified grid, and optimise sensors of the site's first type on it.

    Returns
    -------
    dict of str to Degradation
        Degradation by name of the simplification; the first is `EXACT`.
    """
    exact = finish(compute_visibility(site, models, settings)).visible
    best: Integer | None = None
    results: dict[str, Degradation] = {}
    for one in (Simplification(EXACT, site, models, np.arange(len(site.targets))), *simpler):
        visible = finish(compute_visibility(one.site, one.models, settings)).visible
        problem = placement_problem(one.site, visible, one.models, Objective(count=SITE_SENSORS))
        other_types = site.candidates.sensor != site.candidates.sensor[0]
        placement = finish(solve(replace(problem, forbidden=other_types), SolverLimits(effort=effort)))
        best = placement.chosen if best is None else best
        results[one.name] = Degradation(
            wrong=float((visible[:, one.nearest_target] != exact).sum() / exact.sum()),
            claimed=float(visible[placement.chosen].any(axis=0).mean()),
            coverage=float(exact[placement.chosen].any(axis=0).mean()),
            kept=len(np.intersect1d(placement.chosen, best)),
            proven=placement.gap < 1e-6,
        )
    return results


def every_nth_azimuth(model: LidarModel, n: int) -> LidarModel:
    """Return a model whose azimuth steps are n times as wide."""
    return replace(model, points_per_second=model.points_per_second / n)


def every_other_channel(model: LidarModel) -> LidarModel:
    """Return a model with every second channel; the azimuth steps of each channel stay the same."""
    elevations, offsets = model.elevations[::2], model.azimuth_offsets[::2]
    points = model.points_per_second * len(elevations) / model.channels
    return replace(model, elevations=elevations, azimuth_offsets=offsets, points_per_second=points)


def bounding_box(mesh: Mesh) -> Float:
    """Return the twelve triangles of the axis-aligned bounding box of a mesh, (12, 3, 3) float64."""
    corners = mesh.triangles.reshape(-1, 3)
    # Corner i of the box has the maximum along an axis if bit number `axis` of i is set, otherwise the minimum.
    ends = np.stack([corners.min(axis=0), corners.max(axis=0)])
    box = np.array([[ends[(i >> axis) & 1, axis] for axis in range(3)] for i in range(8)])
    sides = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
    triangles: Float = box[np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])]
    return triangles


def decimated(mesh: Mesh, share: float = 0.25) -> Float:
    """Return a mesh reduced to a share of its faces by Blender's Decimate modifier, (n, 3, 3) float64."""
    corners, index = np.unique(mesh.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    data = bpy.data.meshes.new(mesh.name)
    data.from_pydata(corners.tolist(), [], index.reshape(-1, 3).tolist())
    item = bpy.data.objects.new(mesh.name, data)
    bpy.context.scene.collection.objects.link(item)
    item.modifiers.new("decimate", "DECIMATE").ratio = share
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    simpler = evaluated.to_mesh()
    simpler.calc_loop_triangles()
    points = np.array([vertex.co for vertex in simpler.vertices], dtype=np.float64).reshape(-1, 3)
    faces = np.array([face.vertices[:] for face in simpler.loop_triangles], dtype=np.int64).reshape(-1, 3)
    evaluated.to_mesh_clear()
    bpy.data.objects.remove(item)
    bpy.data.meshes.remove(data)
    triangles: Float = points[faces]
    return triangles
