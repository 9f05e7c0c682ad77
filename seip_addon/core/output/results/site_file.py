"""``site.npz``: what the rows and columns of ``visibility.npz`` are, for reports and analyses without Blender."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import shapely

from ...base.arrays import Boolean, Float
from ...choosing.placement.objective import Solution
from ...choosing.placement.problem import PlacementConstraints
from ...site.scene_geometry import SceneGeometry
from ...site.site import Site, Targets
from ...storage.array_file import ArrayFile

ARRAYS = {
    "targets": "f8",
    "weight": "f8",
    "central": "u1",
    "within": "u1",
    "seen": "u1",
    "counted": "f8",
    "price": "f8",
    "position": "i8",
    "xyz": "f8",
    "sensor": "U",
    "forbidden": "u1",
    "mandatory": "u1",
}
FILE = ArrayFile("seip.site", 1, "table of targets and poses", "place the sensors again", ARRAYS)
WEIGHTED, PLACE = "weighted region", "place"


@dataclass(frozen=True, eq=False)
class Area:
    """A named part of the region, `WEIGHTED` or a `PLACE` of the map (street, crossing), and its targets (t,)."""

    name: str
    kind: str
    within: Boolean


@dataclass(frozen=True, eq=False)
class SiteFile:
    """Part of ``site.npz`` that reports are made of: targets, named areas, and visibility from each chosen sensor.

    ``seen`` (k, t) is in the order of the record, ``weights`` (t,) are those of the objective, and ``key`` is that of
    the visibility grid, ``visibility.npz``.
    """

    key: str
    targets: Targets
    areas: tuple[Area, ...]
    seen: Boolean
    weights: Float


def save_site_file(
    path: str | os.PathLike[str],
    key: str,
    geometry: SceneGeometry,
    site: Site,
    solution: Solution,
    problem: PlacementConstraints,
) -> None:
    """Write ``site.npz``, with the key of the visibility grid and the constraints of the solution's objective."""
    targets = site.targets
    areas = [(WEIGHTED, area) for area in geometry.weighted_regions] + [(PLACE, area) for area in geometry.places]
    within = [shapely.intersects_xy(area.polygon, *targets.xyz[:, :2].T) for _, area in areas]
    header = {
        "key": key,
        "spacing_m": targets.spacing,
        "areas": [[area.name, kind] for kind, area in areas],
        "groups": [str(name) for name in problem.group_names],
        "count": problem.count,
        "budget_usd": problem.budget,
        "min_distance_m": problem.min_distance,
    }
    arrays = {
        "targets": targets.xyz,
        "weight": targets.weight,
        "central": targets.central,
        "within": np.array(within, dtype=bool).reshape(len(areas), len(targets)),
        "seen": solution.deployment.rows.reshape(-1, len(targets)),
        "counted": problem.weights,
        "price": problem.prices,
        "position": problem.positions,
        "xyz": problem.xyz,
        "sensor": problem.labels,
        "forbidden": ~problem.allowed,
        "mandatory": problem.mandatory_groups,
    }
    FILE.save(path, header, arrays)


def load_site_file(path: str | os.PathLike[str]) -> SiteFile:
    """Read what `save_site_file` wrote.

    Raises
    ------
    SeipError
        The file is missing, damaged or something else.
    """
    with FILE.reading(path) as (header, arrays):
        targets = Targets(
            arrays["targets"], arrays["weight"], arrays["central"].astype(bool), float(header["spacing_m"])
        )
        named = [(str(name), str(kind)) for name, kind in header["areas"]]
        areas = tuple(Area(*one, row.astype(bool)) for one, row in zip(named, arrays["within"], strict=True))
        return SiteFile(str(header["key"]), targets, areas, arrays["seen"].astype(bool), arrays["counted"])
