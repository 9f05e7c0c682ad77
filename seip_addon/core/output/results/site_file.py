"""``site.npz``: what the rows and columns of ``visibility.npz`` are, for reports and analyses without Blender."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Boolean, Float
from ...choosing.placement.objective import Solution
from ...choosing.placement.problem import PlacementConstraints
from ...site.scene_geometry import NamedArea, SceneGeometry
from ...site.site import Site, Targets
from ...storage.array_file import ArrayFile

FILE = ArrayFile(
    "seip.site",
    1,
    "table of targets and poses",
    "place the sensors again",
    {
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
    },
)
WEIGHTED, PLACE = "weighted region", "place"


@dataclass(frozen=True, eq=False)
class Area:
    """A named part of the region, and which targets lie in it.

    Parameters
    ----------
    kind : str
        `WEIGHTED`, or `PLACE` for a street or crossing of the map.
    within : (t,) bool
    """

    name: str
    kind: str
    within: Boolean


@dataclass(frozen=True, eq=False)
class SiteFile:
    """Targets, named areas, visibility from each chosen sensor, and the problem that was solved.

    Parameters
    ----------
    key : str
        Key of the visibility grid that this belongs to.
    seen : (k, t) bool
        Targets that each sensor sees, in the order of the record.
    problem : PlacementConstraints
        The problem without its visibility, which is in ``visibility.npz``.
    """

    key: str
    targets: Targets
    areas: tuple[Area, ...]
    seen: Boolean
    problem: PlacementConstraints


def save_site_file(
    path: str | os.PathLike[str],
    key: str,
    geometry: SceneGeometry,
    site: Site,
    solution: Solution,
    problem: PlacementConstraints,
) -> None:
    """Write ``site.npz``.

    Parameters
    ----------
    key : str
        Key of the visibility grid.
    problem : PlacementConstraints
        Constraints and weights of the solution's objective.
    """
    targets = site.targets
    areas = [(WEIGHTED, area) for area in geometry.weighted_regions] + [(PLACE, area) for area in geometry.places]
    names = [str(name) for name in problem.group_names]
    header = {
        "key": key,
        "spacing_m": targets.spacing,
        "areas": [[area.name, kind] for kind, area in areas],
        "groups": names,
        "count": problem.count,
        "budget_usd": problem.budget,
        "min_distance_m": problem.min_distance,
    }
    arrays = {
        "targets": targets.xyz,
        "weight": targets.weight,
        "central": targets.central,
        "within": _within([area for _, area in areas], targets.xyz),
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
        problem = PlacementConstraints(
            weights=arrays["counted"],
            prices=arrays["price"],
            positions=arrays["position"],
            xyz=arrays["xyz"],
            labels=arrays["sensor"],
            mandatory=arrays["mandatory"].astype(bool),
            mandatory_names=np.array(header["groups"], dtype=np.str_),
            forbidden=arrays["forbidden"].astype(bool),
            count=header["count"],
            budget=header["budget_usd"],
            min_distance=float(header["min_distance_m"]),
        )
        areas = tuple(Area(*one, row.astype(bool)) for one, row in zip(named, arrays["within"], strict=True))
        return SiteFile(str(header["key"]), targets, areas, arrays["seen"].astype(bool), problem)


def _within(areas: Sequence[NamedArea], xyz: Float) -> Boolean:
    """Return which targets (t, 3) lie in which areas, (a, t) bool."""
    rows = [shapely.intersects_xy(area.polygon, xyz[:, 0], xyz[:, 1]) for area in areas]
    return np.array(rows, dtype=bool).reshape(len(areas), len(xyz))
