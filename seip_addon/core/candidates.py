"""Candidate poses: where a sensor may hang, and what rules a place out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .arrays import Boolean, Float, Integer, Text
from .errors import SeipError
from .scene_geometry import Mesh, NamedArea, Pole, SceneGeometry
from .targets import surface_height

_POST_FOOT = 0.3
"""Metres above the ground from which a post must keep clear: kerbs and plinths are no walls."""

_FINE_STEPS = 8
"""Fine grid steps per candidate spacing: a strip wider than an eighth of it gets candidates."""


@dataclass(frozen=True)
class CandidateSettings:
    """How candidates are laid out.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys of the sensor types to choose from.
    heights : tuple of float, metres
        Mounting heights above the ground point.
    spacing : float, metres
        Least distance between two positions on the pavement.
    setback : float, metres
        Distance of a new post from the kerb, the edge of the road.
    clearance : float, metres
        Distance of a new post and its sensor from walls and other objects.
    bracket : float, metres
        How far from an existing pole's axis the sensor hangs, towards the region.
    """

    sensors: tuple[str, ...] = ("type1", "type2", "type3")
    heights: tuple[float, ...] = (3.5, 5.4, 8.0)
    spacing: float = 4.0
    setback: float = 0.5
    clearance: float = 0.3
    bracket: float = 0.4

    def __post_init__(self) -> None:
        if not self.sensors:
            raise SeipError("no sensor type is chosen: name at least one of the catalogue")
        if not self.heights:
            raise SeipError("no mounting height is given: name at least one, in metres")
        for height in self.heights:
            if not (np.isfinite(height) and height > 0):
                raise SeipError(f"a mounting height must be a positive number of metres, not {height}")
        if not (np.isfinite(self.spacing) and self.spacing > 0):
            raise SeipError(f"the candidate spacing must be a positive number of metres, not {self.spacing}")
        for name in ("setback", "clearance", "bracket"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise SeipError(f"the {name} must be zero or a positive number of metres, not {value}")


@dataclass(frozen=True, eq=False)
class Candidates:
    """Where a sensor may hang: positions (in plan), and poses (position × height × sensor type).

    Parameters
    ----------
    position : (p, 3) float64, metres
        Ground point of each position, local site axes.
    position_name : (p,) str
        Name of the pole, or ``sidewalk 12``.
    on_pole : (p,) bool
        Whether the position is an existing pole.
    position_of : (c,) int64
        Position of each pose.
    sensor : (c,) str
        Catalogue key of each pose's sensor type.
    height : (c,) float64, metres
        Height of the sensor above the ground point.
    xyz : (c, 3) float64, metres
        Optical centre. On a pole it stands off the shaft by the bracket.
    yaw : (c,) float64, radians
        Direction of azimuth zero of the beam pattern, counter-clockwise from +x.
    mandatory : (g, p) bool
        Each row is a group of positions of which at least one must carry a sensor.
    mandatory_name : (g,) str
        Names of those groups.
    dropped : dict of str to int
        How many positions or poses were dropped, by reason.
    """

    position: Float
    position_name: Text
    on_pole: Boolean
    position_of: Integer
    sensor: Text
    height: Float
    xyz: Float
    yaw: Float
    mandatory: Boolean
    mandatory_name: Text
    dropped: dict[str, int]

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.xyz)


def lay_candidates(geometry: SceneGeometry, settings: CandidateSettings) -> Candidates:
    """Sample the candidate areas, take the poles, and drop what cannot carry a sensor.

    Parameters
    ----------
    geometry : SceneGeometry
    settings : CandidateSettings

    Returns
    -------
    Candidates
        Positions in order of x, y, z with pavement positions named in that
        order; poses by position, height, sensor type.

    Raises
    ------
    SeipError
        A setting cannot be meant, no candidate is left (with what dropped
        them), or a mandatory place holds none.
    """
    dropped: dict[str, int] = {}
    foot, axis_offset, name, on_pole = _positions(geometry, settings, dropped)
    heights = np.array(sorted(set(settings.heights)), dtype=np.float64)
    position_of = np.repeat(np.arange(len(foot)), len(heights))
    height = np.tile(heights, len(foot))
    xyz = foot[position_of] + axis_offset[position_of]
    xyz[:, 2] += height

    inside = _inside_any(xyz, geometry.occluders)
    blocked = np.zeros(len(xyz), dtype=bool)
    post = ~on_pole[position_of] & ~inside
    blocked[post] = _post_blocked(foot[position_of[post]], height[post], settings.clearance, geometry.occluders)
    dropped["inside an object"] = int(inside.sum())
    dropped["too close to a wall or object"] = int(blocked.sum())
    kept = ~inside & ~blocked
    if not kept.any():
        raise SeipError(_none_left(dropped))

    used, compact = np.unique(position_of[kept], return_inverse=True)
    sensors = np.array(list(dict.fromkeys(settings.sensors)))
    repeat = len(sensors)
    groups = _mandatory_groups(geometry, foot[used], name[used])
    return Candidates(
        position=foot[used],
        position_name=name[used],
        on_pole=on_pole[used],
        position_of=np.repeat(compact.astype(np.int64), repeat),
        sensor=np.tile(sensors, int(kept.sum())),
        height=np.repeat(height[kept], repeat),
        xyz=np.repeat(xyz[kept], repeat, axis=0),
        yaw=np.zeros(int(kept.sum()) * repeat),
        mandatory=np.array([row for _, row in groups], dtype=bool).reshape(len(groups), len(used)),
        mandatory_name=np.array([title for title, _ in groups], dtype=np.str_),
        dropped={reason: count for reason, count in dropped.items() if count},
    )


def _positions(
    geometry: SceneGeometry, settings: CandidateSettings, dropped: dict[str, int]
) -> tuple[Float, Float, Text, Boolean]:
    """Foot, offset of the optical axis from it, name and kind of each position, in order of x, y, z."""
    poles = _free_poles(geometry, dropped)
    pole_feet = np.array([pole.base for pole in poles], dtype=np.float64).reshape(-1, 3)
    pavement = _pavement_feet(geometry, settings, pole_feet, dropped)
    foot = np.round(np.concatenate((pavement, pole_feet)), 6)
    offset = np.zeros_like(foot)
    for row, pole in enumerate(poles, start=len(pavement)):
        offset[row, :2] = settings.bracket * _towards(pole.base[:2], geometry.region)
    on_pole = np.arange(len(foot)) >= len(pavement)
    order = np.lexsort((foot[:, 2], foot[:, 1], foot[:, 0]))
    numbers = iter(range(1, len(pavement) + 1))
    pole_names = [pole.name for pole in poles]
    names = [pole_names[i - len(pavement)] if on_pole[i] else f"sidewalk {next(numbers)}" for i in order]
    return foot[order], np.round(offset[order], 6), np.array(names, dtype=np.str_), on_pole[order]


def _free_poles(geometry: SceneGeometry, dropped: dict[str, int]) -> list[Pole]:
    for pole in geometry.poles:
        if pole.forbidden and pole.mandatory:
            raise SeipError(f"pole {pole.name!r} is both forbidden and mandatory: take one of the two marks off")
    forbidden = _union(geometry.forbidden_areas)
    free = [p for p in geometry.poles if not p.forbidden and not forbidden.intersects(shapely.Point(p.base[:2]))]
    for pole in geometry.poles:
        if pole.mandatory and pole not in free:
            raise SeipError(f"mandatory pole {pole.name!r} stands in a forbidden area: take one of the two back")
    dropped["forbidden poles"] = len(geometry.poles) - len(free)
    return free


def _pavement_feet(
    geometry: SceneGeometry, settings: CandidateSettings, poles: Float, dropped: dict[str, int]
) -> Float:
    """(n, 3) feet of new posts: a maximal sample of the candidate areas with the given least distance."""
    area = geometry.candidate_areas
    if area.is_empty:
        return np.empty((0, 3))
    road = plan_outline(geometry.roads)
    free = area.difference(road.buffer(settings.setback)) if not road.is_empty else area
    if len(poles):
        # A pole that stands there already serves its surroundings.
        free = free.difference(shapely.union_all(shapely.buffer(shapely.points(poles[:, :2]), settings.spacing / 2)))
    plan = spread(free, settings.spacing)
    forbidden = _union(geometry.forbidden_areas)
    allowed = ~shapely.intersects_xy(forbidden, plan[:, 0], plan[:, 1])
    dropped["in a forbidden area"] = int((~allowed).sum())
    plan = plan[allowed]
    surface = np.concatenate([mesh.triangles for mesh in (*geometry.ground, *geometry.roads)])
    height = surface_height(plan, surface)
    supported = np.isfinite(height)
    dropped["over no ground"] = int((~supported).sum())
    return np.column_stack((plan[supported], height[supported]))


def spread(area: BaseGeometry, spacing: float) -> Float:
    """Spread points over an area, none closer than ``spacing`` and no room left for another.

    A maximal Poisson-disc sample drawn from a fine grid in order of x, then y:
    deterministic, uniform on wide areas, and evenly spaced along narrow strips,
    which a plain grid of that spacing would hit or miss by chance.

    Parameters
    ----------
    area : shapely geometry
        In plan, metres.
    spacing : float, metres

    Returns
    -------
    (n, 2) float64, metres
    """
    if area.is_empty:
        return np.empty((0, 2))
    step = spacing / _FINE_STEPS
    low_x, low_y, high_x, high_y = area.bounds
    axes = (np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    x, y = (values.ravel() for values in np.meshgrid(*axes, indexing="ij"))
    shapely.prepare(area)
    inside = shapely.intersects_xy(area, x, y)
    fine = np.column_stack((x[inside], y[inside]))
    taken = []
    free = np.ones(len(fine), dtype=bool)
    while free.any():
        point = fine[np.argmax(free)]
        taken.append(point)
        free &= np.hypot(*(fine - point).T) >= spacing * (1 - 1e-9)
    return np.array(taken).reshape(-1, 2)


def _towards(point: Float, region: BaseGeometry) -> Float:
    """Return the unit vector in plan from a point to the region, or to its middle from within."""
    nearest = shapely.shortest_line(shapely.Point(point), region)
    goal = np.array(nearest.coords[-1])
    if np.hypot(*(goal - point)) < 1e-6:
        goal = np.array(region.centroid.coords[0])
    way = goal - point
    length = np.hypot(*way)
    return way / length if length > 0 else np.array((1.0, 0.0))


def _inside_any(points: Float, meshes: Sequence[Mesh]) -> Boolean:
    """Whether each point lies inside some object, by its winding number."""
    inside = np.zeros(len(points), dtype=bool)
    for mesh in meshes:
        if not len(mesh.triangles):
            continue
        low, high = mesh.triangles.min(axis=(0, 1)), mesh.triangles.max(axis=(0, 1))
        near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1) & ~inside)
        inside[near] = np.abs(winding_number(points[near], mesh.triangles)) > 0.5
    return inside


def winding_number(points: Float, triangles: Float) -> Float:
    """Generalised winding number of a triangle soup: 1 (or −1) inside, 0 outside, between where it is open.

    Parameters
    ----------
    points : (n, 3) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) float64

    Notes
    -----
    Solid angle of a triangle after van Oosterom and Strackee (1983); as a test
    for open and messy meshes Jacobson et al. (2013).
    """
    total = np.zeros(len(points))
    for row, point in enumerate(points):
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        total[row] = np.arctan2(volume, la * lb * lc + dots).sum() / (2 * np.pi)
    return total


def _post_blocked(foot: Float, height: Float, clearance: float, meshes: Sequence[Mesh]) -> Boolean:
    """Whether a post with its sensor comes closer than ``clearance`` to an object.

    A triangle counts when it is that close in plan and its span of heights
    meets the post's: on the safe side for leaning faces.
    """
    blocked = np.zeros(len(foot), dtype=bool)
    triangles = np.concatenate([mesh.triangles for mesh in meshes]) if meshes else np.empty((0, 3, 3))
    if not len(foot) or not len(triangles):
        return blocked
    low, high = triangles[:, :, 2].min(axis=1), triangles[:, :, 2].max(axis=1)
    corners = shapely.points(triangles[:, :, :2])
    tree = shapely.STRtree(shapely.convex_hull(shapely.multipoints(corners)))
    post, triangle = tree.query(shapely.points(foot[:, :2]), predicate="dwithin", distance=clearance)
    meets = (low[triangle] < foot[post, 2] + height[post] + clearance) & (high[triangle] > foot[post, 2] + _POST_FOOT)
    blocked[post[meets]] = True
    return blocked


def _mandatory_groups(geometry: SceneGeometry, foot: Float, name: Text) -> list[tuple[str, Boolean]]:
    groups = []
    for pole in geometry.poles:
        if pole.mandatory:
            here = np.hypot(*(foot[:, :2] - pole.base[:2]).T) < 1e-3
            groups.append((pole.name, here & (name == pole.name)))
    groups += [(a.name, shapely.intersects_xy(a.polygon, foot[:, 0], foot[:, 1])) for a in geometry.mandatory_areas]
    for title, row in groups:
        if not row.any():
            raise SeipError(
                f"{title!r} must carry a sensor but holds no candidate position: "
                "enlarge it, or free it of forbidden areas and obstacles"
            )
    return groups


def plan_outline(meshes: Sequence[Mesh]) -> BaseGeometry:
    """Union of the meshes' triangles in plan, to a millimetre."""
    triangles = [mesh.triangles[:, :, :2] for mesh in meshes]
    corners = np.concatenate(triangles) if triangles else np.empty((0, 3, 2))
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
    rings = corners[area > 1e-9][:, [0, 1, 2, 0]]
    return shapely.union_all(shapely.polygons(rings), grid_size=1e-3)


def _union(areas: Sequence[NamedArea]) -> BaseGeometry:
    union = shapely.union_all([area.polygon for area in areas])
    shapely.prepare(union)
    return union


def _none_left(dropped: dict[str, int]) -> str:
    reasons = ", ".join(f"{count} {reason}" for reason, count in dropped.items() if count)
    cure = "enlarge SEIP Candidate Areas, add SEIP Poles, or ask for less set-back and clearance"
    return f"no candidate is left ({reasons}): {cure}" if reasons else f"no candidate: {cure}"
