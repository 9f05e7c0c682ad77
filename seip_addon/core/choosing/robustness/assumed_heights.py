"""Coverage of a placement if assumed heights of obstacles are wrong."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...sensing.visibility.surroundings import Surroundings
from ...sensing.visibility.visibility_model import visibility_model
from ...site.far_objects import without_far_objects
from ...site.scene_geometry import Mesh, SceneGeometry, ordered_surfaces
from ..placement.deployment import Sensor

CHANGES = (0.7, 1.3)
"""Factors by which assumed heights are varied."""
MIN_CHANGE = 0.01  # least change of the region's coverage for a note


def with_heights(geometry: SceneGeometry, factor: float) -> SceneGeometry:
    """Return a scene with the assumed heights of occluders, above their own feet, multiplied by a factor."""
    return replace(geometry, occluders=tuple(_scaled(mesh, factor) for mesh in geometry.occluders))


def _scaled(mesh: Mesh, factor: float) -> Mesh:
    if not mesh.height_assumed:
        return mesh
    foot = mesh.triangles[:, :, 2].min()
    return replace(mesh, triangles=mesh.triangles * [1, 1, factor] + [0, 0, foot * (1 - factor)])


def coverage_by_heights(around: Surroundings, geometry: SceneGeometry, sensors: Sequence[Sensor]) -> dict[float, float]:
    """Return the coverage of sensors for each factor of `CHANGES`; empty if no height is assumed."""
    if not sensors or not any(mesh.height_assumed for mesh in geometry.occluders):
        return {}
    reach = max(sensor.model.max_range for sensor in sensors)
    found = {}
    for factor in CHANGES:
        near, _ = without_far_objects(with_heights(geometry, factor), geometry.region, reach)
        triangles, reflectivity = ordered_surfaces((*near.roads, *near.ground, *near.occluders))
        changed = replace(around.site, triangles=triangles, reflectivity=reflectivity)
        model = visibility_model(changed, around.sight, around.engine)
        seen = np.any([model.see(one.model, one.xyz, one.orientation) for one in sensors], axis=0)
        found[factor] = float(seen.mean())
    return found


def height_notes(
    around: Surroundings, geometry: SceneGeometry, sensors: Sequence[Sensor], coverage: float
) -> tuple[str, ...]:
    """Return a note on coverage under changed heights, if it changes by more than `MIN_CHANGE`."""
    found = coverage_by_heights(around, geometry, sensors)
    if max((abs(other - coverage) for other in found.values()), default=0.0) <= MIN_CHANGE:
        return ()
    low, high = (found[factor] for factor in CHANGES)
    return (
        f"heights of obstacles are partly assumed: with these 30 % lower coverage is {low:.1%}, 30 % higher {high:.1%}",
    )
