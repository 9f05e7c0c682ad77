"""Checks of a scene: counts, and problems with their remedies."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..base.counts import counted
from ..base.errors import SeipError
from ..base.progress import Progress
from ..geometry.plan import outline, signed_area, surface_height
from .scene_geometry import ASSUMED, Pole, SceneGeometry
from .site import Site

MAX_ORIGIN_DISTANCE = 10_000.0
"""Metres from the origin beyond which Blender's single precision rounds coordinates to a millimetre and more."""
MIN_REGION_SIZE, MAX_REGION_SIZE = 5.0, 10_000.0
"""Plausible sizes of a region of interest, metres."""
MIN_PLAN_SHARE = 0.5
"""Ratio of a surface's area in plan to its area, below which it counts as vertical."""
MAX_POLE_DISTANCE = 60.0
"""Metres from the region beyond which a pole probably belongs to a different place."""
MAX_FOOT_OFFSET = 0.5
"""Metres between a pole's foot and the ground beyond which sensors would be at a wrong height."""
SAME_POLE_DISTANCE = 0.05
"""Metres in plan within which two poles count as being in one place."""
MAX_NAMED = 5
"""Number of objects with the same problem that are named individually."""

Severity = Literal["ERROR", "WARNING"]
ROLES = {
    "region": "Region",
    "roads": "Roads",
    "ground": "Ground",
    "occluders": "Occluders",
    "candidate_areas": "Candidate areas",
    "weighted_regions": "Weighted regions",
    "forbidden_areas": "Forbidden areas",
    "mandatory_areas": "Mandatory areas",
}
"""Roles of surfaces, with their titles."""
STAGES = 5


@dataclass(frozen=True)
class Problem:
    """A problem of a scene: it makes a survey impossible, or its result unreliable.

    Parameters
    ----------
    severity : {"ERROR", "WARNING"}
        An error stops a survey.
    text : str
        The problem and its remedy.
    obj : str
        Name of the object concerned; "" for the scene as a whole.
    """

    severity: Severity
    text: str
    obj: str = ""


@dataclass(frozen=True, eq=False)
class Surface:
    """An object's surface in one of its roles.

    Parameters
    ----------
    role : str
        Role, a key of `ROLES`.
    name : str
        Name of the object, or of the one that instances it.
    triangles : (n, 3, 3) float64, metres
        Triangles in local site axes.
    """

    role: str
    name: str
    triangles: Float


@dataclass(frozen=True, eq=False)
class SceneContents:
    """Contents of a scene, whether complete or not.

    Parameters
    ----------
    surfaces : tuple of Surface
        Surfaces, without faulty ones.
    poles : tuple of Pole
        Poles.
    geometry : SceneGeometry or None
        Geometry for a survey; None if a required part is missing.
    problems : tuple of Problem
        Problems found while reading.
    complaint : str
        Reason why there is no geometry, or "".
    built : frozenset of str
        Names of the objects that the builder of sites made: a user can do nothing about them, and is not warned.
    """

    surfaces: tuple[Surface, ...]
    poles: tuple[Pole, ...]
    geometry: SceneGeometry | None
    problems: tuple[Problem, ...]
    complaint: str = ""
    built: frozenset[str] = frozenset()


@dataclass(frozen=True)
class SiteCheck:
    """Result of a check: counts of a scene's contents, and its problems, errors first."""

    counts: dict[str, str]
    problems: tuple[Problem, ...]


def check_site(
    contents: SceneContents, lay_out: Callable[[SceneGeometry], tuple[Site, Sequence[str]]]
) -> Generator[Progress, None, SiteCheck]:
    """Check a scene: count its contents and find problems that would affect a result.

    Parameters
    ----------
    lay_out : callable
        Function that makes the site of a scene, with targets and candidates, and returns it with warnings.

    Yields
    ------
    Progress
        Number of completed checks.

    Returns
    -------
    SiteCheck
    """
    plans: dict[str, BaseGeometry] = {}
    for number, role in enumerate(("region", "roads", "candidate_areas")):
        yield Progress(number, STAGES, "outlines", counted=False)
        plans[role] = outline(np.concatenate([np.empty((0, 3, 3)), *_triangles(contents, role)]))
    yield Progress(3, STAGES, "problems", counted=False)
    problems = [*contents.problems, *_problems(contents, plans)]
    counts = _counts(contents, plans)
    yield Progress(4, STAGES, "candidates", counted=False)
    if contents.geometry is not None:
        try:
            site, warnings = lay_out(contents.geometry)
        except SeipError as error:
            problems.append(Problem("ERROR", str(error), _named_in(str(error), contents)))
        else:
            counts |= _site_counts(site)
            problems += [Problem("WARNING", text) for text in warnings]
    elif not any(problem.severity == "ERROR" for problem in problems):
        problems.append(Problem("ERROR", contents.complaint, _named_in(contents.complaint, contents)))
    yield Progress(STAGES, STAGES, "candidates", counted=False)
    of_user = (one for one in problems if one.severity == "ERROR" or one.obj not in contents.built)
    return SiteCheck(counts, _in_order(of_user))


def _in_order(problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """Return each problem once, errors first."""
    by_text = {problem.text: problem for problem in reversed(list(problems))}
    once = reversed(by_text.values())
    return tuple(sorted(once, key=lambda problem: problem.severity != "ERROR"))


def _named_in(text: str, contents: SceneContents) -> str:
    """Return the name of the object that a message quotes, or ""."""
    names = [surface.name for surface in contents.surfaces] + [pole.name for pole in contents.poles]
    return next((name for name in names if f"{name!r}" in text), "")


def _of(contents: SceneContents, role: str) -> list[Surface]:
    return [surface for surface in contents.surfaces if surface.role == role]


def _triangles(contents: SceneContents, role: str) -> list[Float]:
    return [surface.triangles for surface in _of(contents, role)]


def _counts(contents: SceneContents, plans: dict[str, BaseGeometry]) -> dict[str, str]:
    counts = {}
    for role, title in ROLES.items():
        surfaces = _of(contents, role)
        if surfaces or role in {"region", "roads"}:
            faces = sum(len(surface.triangles) for surface in surfaces)
            counts[title] = f"{counted(len(surfaces), 'object')}, {counted(faces, 'triangle')}"
    counts["Poles"] = counted(len(contents.poles), "pole")
    for mark in ("forbidden", "mandatory"):
        marked = sum(getattr(pole, mark) for pole in contents.poles)
        counts["Poles"] += f", {marked} {mark}" * (marked > 0)
    assumed = sum(pole.source == ASSUMED for pole in contents.poles)
    counts["Poles"] += f", {assumed} assumed" * (assumed > 0)
    region, road = plans["region"], plans["roads"]
    counts["Area of the region"] = f"{region.area:,.0f} m²"
    counts["Road in the region"] = f"{region.intersection(road).area:,.0f} m²"
    counts["Candidate area"] = f"{plans['candidate_areas'].area:,.0f} m²"
    return counts


def _site_counts(site: Site) -> dict[str, str]:
    poses = site.candidates
    on_poles = int(poses.on_pole.sum())
    counts = {
        "Targets": f"{len(site.targets):,}, {int(site.targets.central.sum()):,} in weighted regions",
        "Positions": f"{len(poses.position):,}, {on_poles:,} on poles",
        "Poses": f"{len(poses):,}",
    }
    return counts | {f"Dropped, {reason}": f"{count:,}" for reason, count in poses.dropped.items()}


def _problems(contents: SceneContents, plans: dict[str, BaseGeometry]) -> Iterator[Problem]:
    yield from _missing(contents, plans)
    yield from _wrong_size(contents, plans["region"])
    yield from _far(contents)
    yield from _upright(contents)
    yield from _without_road(contents, plans)
    yield from _pole_problems(contents, plans["region"])


def _missing(contents: SceneContents, plans: dict[str, BaseGeometry]) -> Iterator[Problem]:
    if plans["region"].is_empty:
        yield Problem("ERROR", "There is no region of interest: draw one, or assign a mesh that covers the road to it.")
    if not _of(contents, "roads"):
        yield Problem("ERROR", "There is no road: assign the meshes of the carriageway to the roads.")
    if plans["candidate_areas"].is_empty and not contents.poles:
        yield Problem(
            "ERROR", "There is no position for a sensor: assign pavements to the candidate areas, or assign poles."
        )


def _wrong_size(contents: SceneContents, region: BaseGeometry) -> Iterator[Problem]:
    if region.is_empty:
        return
    low_x, low_y, high_x, high_y = region.bounds
    across = max(high_x - low_x, high_y - low_y)
    if not MIN_REGION_SIZE <= across <= MAX_REGION_SIZE:
        yield Problem(
            "WARNING",
            f"The region is {across:,.3g} m across: one unit of Blender is one metre; scale the scene if it is not.",
            _of(contents, "region")[0].name,
        )


def _far(contents: SceneContents) -> Iterator[Problem]:
    reaches = [(float(np.abs(surface.triangles).max()), surface.name) for surface in contents.surfaces]
    reaches += [(float(np.abs(pole.base).max()), pole.name) for pole in contents.poles]
    far = [(reach, name) for reach, name in reaches if reach > MAX_ORIGIN_DISTANCE]
    if far:
        reach, name = max(far)
        others = f" and {counted(len(far) - 1, 'other object')} lie up to" if len(far) > 1 else " lies"
        yield Problem(
            "WARNING",
            f"{name!r}{others} {reach / 1000:,.0f} km from the origin, "
            f"where Blender rounds coordinates to {1000 * np.spacing(np.float32(reach)):.0f} mm: move all to the "
            "origin, and store the map coordinates of the origin in the scene's property seip_origin.",
            name,
        )


def _upright(contents: SceneContents) -> Iterator[Problem]:
    """Find vertical surfaces among those that should be level, as in a model with a different up axis."""
    for surface in contents.surfaces:
        if surface.role in {"region", "roads", "candidate_areas", "weighted_regions"}:
            side = np.linalg.norm(_normals(surface.triangles), axis=1).sum() / 2
            if np.abs(signed_area(surface.triangles)).sum() < MIN_PLAN_SHARE * side:
                yield Problem(
                    "WARNING",
                    f"{surface.name!r} among the {ROLES[surface.role].lower()} is mostly vertical: rotate it so "
                    "that z is up, or remove it.",
                    surface.name,
                )


def _normals(triangles: Float) -> Float:
    normals: Float = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals


def _without_road(contents: SceneContents, plans: dict[str, BaseGeometry]) -> Iterator[Problem]:
    road = plans["roads"]
    if road.is_empty or plans["region"].is_empty:
        return
    reached = shapely.intersection(plans["region"], road).area > 0
    for surface in _of(contents, "region"):
        if outline(surface.triangles).intersection(road).area == 0:
            yield Problem(
                "WARNING" if reached else "ERROR",
                f"There is no road within the region {surface.name!r}: move the region over the road.",
                surface.name,
            )
    shapely.prepare(plans["region"])
    for role in ("weighted_regions", "mandatory_areas"):
        for surface in _of(contents, role):
            lies_in = plans["region"] if role == "weighted_regions" else plans["region"].buffer(MAX_POLE_DISTANCE)
            if not lies_in.intersects(outline(surface.triangles)):
                yield Problem(
                    "WARNING",
                    f"{surface.name!r} among the {ROLES[role].lower()} lies outside the region of interest: "
                    "move it or remove it.",
                    surface.name,
                )


def _pole_problems(contents: SceneContents, region: BaseGeometry) -> Iterator[Problem]:
    poles = sorted(contents.poles, key=lambda pole: pole.name not in contents.built)  # of two, the user's is named
    own = [pole.name not in contents.built for pole in poles]
    if not any(own):
        return
    feet = np.array([pole.base for pole in poles])
    distance = shapely.distance(region, shapely.points(feet[:, :2])) if not region.is_empty else np.zeros(len(feet))
    yield from _named(
        [
            (pole.name, f"The pole {pole.name!r} stands {away:,.0f} m from the region: remove it from the poles.")
            for pole, away, is_own in zip(poles, distance, own, strict=True)
            if is_own and away > MAX_POLE_DISTANCE
        ],
        f"pole stands more than {MAX_POLE_DISTANCE:g} m from the region: remove it from the poles",
        f"poles stand more than {MAX_POLE_DISTANCE:g} m from the region: remove them from the poles",
    )
    under = np.concatenate([np.empty((0, 3, 3)), *_triangles(contents, "roads"), *_triangles(contents, "ground")])
    above = feet[:, 2] - surface_height(feet[:, :2], under) if len(under) else np.full(len(feet), np.nan)
    yield from _named(
        [
            (
                pole.name,
                f"The foot of the pole {pole.name!r} is {_level(high)} the ground: move it, or its origin, there.",
            )
            for pole, high, is_own in zip(poles, above, own, strict=True)
            if is_own and abs(high) > MAX_FOOT_OFFSET
        ],
        f"pole has its foot more than {MAX_FOOT_OFFSET:g} m above or below the ground: move it or its origin",
        f"poles have their foot more than {MAX_FOOT_OFFSET:g} m above or below the ground: move them or their origins",
    )
    nearest = shapely.STRtree(shapely.points(feet[:, :2])).query(
        shapely.points(feet[:, :2]), predicate="dwithin", distance=SAME_POLE_DISTANCE
    )
    yield from _named(
        [
            (poles[b].name, f"The poles {poles[a].name!r} and {poles[b].name!r} stand at one place: remove one.")
            for a, b in nearest.T
            if a < b and own[b]
        ],
        "pole stands where another one stands: remove one of the two",
        "poles stand where others stand: remove one of each two",
    )


def _level(high: float) -> str:
    return f"{abs(high):.1f} m {'above' if high > 0 else 'below'}"


def _named(culprits: list[tuple[str, str]], one: str, several: str) -> Iterator[Problem]:
    """Yield problems for the first few objects individually, and one for all others together."""
    yield from (Problem("WARNING", text, name) for name, text in culprits[:MAX_NAMED])
    rest = culprits[MAX_NAMED:]
    if rest:
        yield Problem("WARNING", f"{counted(len(rest), f'more {one}', f'more {several}')}.", rest[0][0])
