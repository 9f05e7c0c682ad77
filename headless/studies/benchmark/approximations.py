"""Approximations of visibility: fewer rays, channels or targets, or simpler objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import DEFAULT_REFLECTIVITY, Mesh, SceneGeometry
from seip_addon.core.site.site import Site, make_site


@dataclass(frozen=True, eq=False)
class Approximation:
    """A simplified site and simplified sensor types, with the same candidate poses as the exact ones.

    Parameters
    ----------
    name : str
        Name of the approximation, as in ``azimuth ÷ 2``.
    family : str
        Group of approximations of one kind, which share a colour in charts.
    site : Site
        Simplified site.
    models : mapping of str to LidarModel
        Simplified sensor types by catalogue key.
    nearest_target : (t,) int64
        Index of the target of ``site`` that represents each target of the exact site.
    """

    name: str
    family: str
    site: Site
    models: Mapping[str, LidarModel]
    nearest_target: Integer

    def on_exact_targets(self, visible: Boolean) -> Boolean:
        """Return a visibility grid of the simplified site as one for the targets of the exact site, (c, t) bool."""
        visible_exact: Boolean = visible[:, self.nearest_target]
        return visible_exact


def approximations(
    geometry: SceneGeometry, site: Site, models: Mapping[str, LidarModel], layout: CandidateSettings
) -> list[Approximation]:
    """Return the approximations: fewer azimuth steps, fewer channels, a coarser grid, simpler objects."""
    same_targets = np.arange(len(site.targets))
    return [
        *(
            Approximation(f"azimuth ÷ {n}", "azimuth", site, _changed(models, partial(thinner, times=n)), same_targets)
            for n in (2, 4, 8)
        ),
        Approximation("channels ÷ 2", "channels", site, _changed(models, every_other_channel), same_targets),
        *(_coarser(geometry, site, models, layout, factor) for factor in (2, 4)),
        Approximation("objects as boxes", "objects", _with_objects(geometry, site, bounding_box), models, same_targets),
        Approximation("objects decimated", "objects", _with_objects(geometry, site, decimated), models, same_targets),
    ]


def thinner(model: LidarModel, times: int) -> LidarModel:
    """Return a model whose azimuth steps are `times` as wide."""
    return replace(model, points_per_second=model.points_per_second / times)


def every_other_channel(model: LidarModel) -> LidarModel:
    """Return a model with every second channel; the azimuth steps of each channel stay the same."""
    elevations, offsets = model.elevations[::2], model.azimuth_offsets[::2]
    share = len(elevations) / model.channels
    points = model.points_per_second * share
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


def _changed(models: Mapping[str, LidarModel], change: Callable[[LidarModel], LidarModel]) -> dict[str, LidarModel]:
    return {key: change(model) for key, model in models.items()}


def _coarser(
    geometry: SceneGeometry,
    site: Site,
    models: Mapping[str, LidarModel],
    layout: CandidateSettings,
    factor: int,
) -> Approximation:
    """Return a coarser grid of targets; the nearest coarse target represents each target of the exact grid."""
    spacing = site.targets.spacing * factor
    coarse = make_site(geometry, layout, spacing, fields_of_view=fields_of_view(models))
    offset = site.targets.xyz[:, None, :2] - coarse.targets.xyz[None, :, :2]
    nearest = (offset**2).sum(axis=2).argmin(axis=1)
    return Approximation(f"grid of {spacing:g} m", "grid", coarse, models, nearest)


def _with_objects(geometry: SceneGeometry, site: Site, simplify: Callable[[Mesh], Float]) -> Site:
    surfaces = [mesh.triangles for mesh in (*geometry.roads, *geometry.ground)]
    objects = [simplify(mesh) for mesh in geometry.occluders]
    return with_triangles(site, np.concatenate([*surfaces, *objects]))


def with_triangles(site: Site, triangles: Float) -> Site:
    """Return a site with its triangles replaced by `triangles` (n, 3, 3), all of the default reflectivity."""
    return replace(site, triangles=triangles, reflectivity=np.full(len(triangles), DEFAULT_REFLECTIVITY))
