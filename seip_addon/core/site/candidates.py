"""Candidate poses, and the rules that exclude positions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float, Integer, Text
from ..base.counts import counted, typed_number
from ..base.errors import SeipError
from ..base.settings import setting
from ..geometry.orientation import orientation
from ..geometry.plan import outline, surface_height
from .obstruction import inside_any, post_blocked
from .pavement_sampling import spread
from .post_rules import ALLOWED, ASSUMED_POLES, RULES, AllowedName, check_allowed, excluded_posts
from .scene_geometry import ASSUMED, NamedArea, Pole, SceneGeometry, joined

DEFAULT_TYPE = "os1_128"
"""Catalogue key of the sensor type of a new survey: a product whose detection law is calibrated on measured sweeps."""

PAPER_TYPES = ("type1", "type2", "type3")
"""Catalogue keys of the sensor models of the SEIP paper."""

_MAX_ABOVE_POLE = 0.5
"""Metres that a sensor may be mounted above the top of its pole, on a short mast."""

MAX_SENSOR_HEIGHT = 100.0
"""Metres above the ground; larger heights are rejected as typing errors."""

ON_ASSUMED_POLE = "on an assumed pole"
"""Reason for which assumed poles are dropped."""

MAX_TILT = 90.0
"""Degrees: tilts are less than this, up or down."""

MAX_YAWS = 360
"""Yaws over the circle; larger numbers are rejected as typing errors."""
_MIN_STEP = 0.01
"""Least step of a range, metres or degrees; finer ranges are rejected as typing errors."""
_HEIGHTS = (
    f"a height in metres nor a range FROM:TO:STEP up to {MAX_SENSOR_HEIGHT:g} m in steps of at least {_MIN_STEP:g} m"
)
_TILTS = f"a tilt in degrees nor a range FROM:TO:STEP within ±{MAX_TILT:g}° in steps of at least {_MIN_STEP:g}°"


@dataclass(frozen=True)
class CandidateSettings:
    """Settings of candidate poses: sensor types, heights, tilts, yaws, spacing and clearances.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys of the sensor types to choose from.
    heights : tuple of float, metres
        Mounting heights above the ground point.
    tilts : tuple of float, radians
        Angles by which a sensor's nose is tilted down towards the region, the direction of its bracket; negative is
        up, 0 is upright.
    yaws : int
        Number of directions, evenly over the circle, for sensors with a limited horizontal field of view; the first is
        towards the region, and each is combined with all tilts.
    spacing : float, metres
        Least distance between two positions on the pavement.
    setback : float, metres
        Distance of a new post from the kerb, the edge of the road.
    clearance : float, metres
        Distance of a new post and its sensor from walls and other objects.
    bracket : float, metres
        Distance of a sensor from the axis of an existing pole, towards the region.
    allow : tuple of str
        Names of the rules of `post_rules.RULES` that do not apply, by default all apply; and `ASSUMED_POLES` if assumed
        poles, which are not in the map, may carry sensors.
    """

    sensors: tuple[str, ...] = setting((DEFAULT_TYPE,), "types to choose from", option="sensor", metavar="KEY")
    heights: tuple[float, ...] = setting(
        (3.5, 5.4, 8.0),
        "metres, or FROM:TO:STEP",
        unit="m",
        maximum=MAX_SENSOR_HEIGHT,
        metavar="M",
        read=lambda texts: heights_of(texts),  # noqa: PLW0108 -- defined below
    )
    tilts: tuple[float, ...] = setting(
        (0.0,),
        "degrees nose down towards the region, or FROM:TO:STEP; up where negative",
        unit="rad",
        metavar="DEG",
        read=lambda texts: tilts_of(texts),  # noqa: PLW0108 -- as above
    )
    yaws: int = 8
    spacing: float = setting(4.0, "distance between new posts on the pavement", unit="m", minimum=0.1, maximum=1000.0)
    setback: float = 0.5
    clearance: float = 0.3
    bracket: float = 0.4
    allow: tuple[AllowedName, ...] = setting((), f"also use: {' '.join(ALLOWED)}", metavar="RULE")

    def __post_init__(self) -> None:
        if not self.sensors:
            raise SeipError("no sensor type is chosen: give at least one from the catalogue")
        if not self.heights:
            raise SeipError("no mounting height is given: give at least one, in metres")
        for height in self.heights:
            if not 0 < height <= MAX_SENSOR_HEIGHT:
                raise SeipError(
                    f"a mounting height must be a positive number of metres up to {MAX_SENSOR_HEIGHT:g}, not {height}"
                )
        self._check_tilts()
        check_allowed(self.allow)
        if not 1 <= self.yaws <= MAX_YAWS:
            raise SeipError(f"there must be 1 to {MAX_YAWS} yaws, not {self.yaws}")
        if not 0.1 <= self.spacing <= 1000:
            raise SeipError(f"the candidate spacing must be 0.1 to 1000 m, not {self.spacing}")
        for name in ("setback", "clearance", "bracket"):
            value = getattr(self, name)
            if not 0 <= value <= 100:
                raise SeipError(f"the {name} must be 0 to 100 m, not {value}")

    def _check_tilts(self) -> None:
        if not self.tilts:
            raise SeipError("no tilt is given: give at least one, in degrees; 0 is upright")
        for number, tilt in enumerate(self.tilts):
            if not abs(math.degrees(tilt)) < MAX_TILT:
                raise SeipError(
                    f"a tilt must be more than -{MAX_TILT:g}° and less than {MAX_TILT:g}°, not {math.degrees(tilt):g}°"
                )
            if tilt in self.tilts[:number]:
                raise SeipError(f"the tilt of {math.degrees(tilt):g}° is given twice: give each tilt once")


def heights_of(texts: Sequence[str]) -> tuple[float, ...]:
    """Parse heights in metres; each text is a height, or a range FROM:TO:STEP that includes both ends.

    Raises
    ------
    SeipError
        One is neither.
    """
    return tuple(_numbers(texts, 0.0, MAX_SENSOR_HEIGHT, _HEIGHTS))


def tilts_of(texts: Sequence[str]) -> tuple[float, ...]:
    """Parse tilts in degrees to radians; each text is a tilt, or a range FROM:TO:STEP that includes both ends.

    Raises
    ------
    SeipError
        One is neither.
    """
    return tuple(math.radians(tilt) + 0.0 for tilt in _numbers(texts, -MAX_TILT, MAX_TILT, _TILTS))


def _numbers(texts: Sequence[str], above: float, most: float, what: str) -> list[float]:
    """Return the numbers that all texts name; ``what`` they may be is for messages."""
    numbers: list[float] = []
    for text in texts:
        named = _named_by(text, above, most)
        if not named:
            raise SeipError(f"{text!r} is neither {what}")
        numbers += named
    return numbers


def _named_by(text: str, above: float, most: float) -> list[float]:
    """Return the number in a text, or those of a range FROM:TO:STEP; an empty list if it is neither."""
    try:
        numbers = [typed_number(part) for part in text.split(":")]
    except ValueError:
        return []
    if len(numbers) == 1:
        return numbers
    if len(numbers) == 3 and above < numbers[0] <= numbers[1] <= most and numbers[2] >= _MIN_STEP:
        first, last, step = numbers
        steps: list[float] = np.round(np.arange(first, last + step * 1e-6, step), 6).tolist()
        return steps
    return []


@dataclass(frozen=True, eq=False)
class Candidates:
    """The p mounting positions of a site and its c candidate poses (position × height × tilt × sensor type × yaw).

    Parameters
    ----------
    position : (p, 3) float64, metres
        Ground point of each position, local site axes.
    position_name : (p,) str
        Name of the pole, or ``sidewalk 12``.
    on_pole : (p,) bool
        Whether the position is an existing pole.
    pole_source : (p,) str
        Source of the pole, as in `Pole`; empty for new posts.
    position_of : (c,) int64
        Position of each pose.
    sensor : (c,) str
        Catalogue key of each pose's sensor type.
    height : (c,) float64, metres
        Height of the sensor above the ground point.
    xyz : (c, 3) float64, metres
        Optical centre; on a pole it is a bracket's length away from the shaft.
    yaw : (c,) float64, radians
        Direction of azimuth zero of the beam pattern, counter-clockwise from +x. Upright sensors with a full horizontal
        field of view have azimuth zero along +x. Tilted ones point to the nearest point of the region, or to its centre
        from within. Those with a limited horizontal field of view have several yaws; see `with_yaws`.
    tilt : (c,) float64, radians
        Angle of azimuth zero below the horizon, in the direction of the yaw; see `orientation`.
    mandatory : (g, p) bool
        Groups of positions, one in each row, of which at least one must carry a sensor.
    mandatory_name : (g,) str
        Names of those groups.
    dropped : dict of str to int
        Number of dropped positions or poses, by reason.
    installation : (p,) float64, dollars, optional
        Cost of installing a sensor at each position; None if prices include only the sensors.
    """

    position: Float
    position_name: Text
    on_pole: Boolean
    pole_source: Text
    position_of: Integer
    sensor: Text
    height: Float
    xyz: Float
    yaw: Float
    tilt: Float
    mandatory: Boolean
    mandatory_name: Text
    dropped: dict[str, int]
    installation: Float | None = None

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.xyz)

    def orientation(self, pose: int) -> Float:
        """Return the rotation (3, 3) float64 from the axes of a pose's sensor to those of the site."""
        return orientation(float(self.yaw[pose]), float(self.tilt[pose]))

    def only(self, poses: Integer) -> Candidates:
        """Return the candidates with some poses (k,), in that order, and with all positions."""
        of_poses = ("position_of", "sensor", "height", "xyz", "yaw", "tilt")
        return replace(self, **{name: getattr(self, name)[poses] for name in of_poses})


def generate_candidates(geometry: SceneGeometry, settings: CandidateSettings, most: float = math.inf) -> Candidates:
    """Generate candidate poses on the candidate areas and poles, without those where no sensor can be mounted.

    Parameters
    ----------
    most : float
        Largest number of poses; more are refused before any is tested.

    Returns
    -------
    Candidates
        Positions in order of x, y, z, with pavement positions numbered in that order; poses by position, height, tilt,
        sensor type.

    Raises
    ------
    SeipError
        No candidate is left (with the reasons), there are too many, or a mandatory pole or area has none.

    Examples
    --------
    >>> from seip_addon.core.site.scene_geometry import Mesh
    >>> road = np.array([[(0, 0, 0), (40, 0, 0), (40, 8, 0)], [(0, 0, 0), (40, 8, 0), (0, 8, 0)]], dtype=float)
    >>> lamp = Pole("lamp 1", np.array([20.0, -1.0, 0.0]), height=8.0)
    >>> region = shapely.box(0.0, 0.0, 40.0, 8.0)
    >>> scene = SceneGeometry("street", np.zeros(3), (Mesh("road", road),), (), (), region, poles=(lamp,))
    >>> candidates = generate_candidates(scene, CandidateSettings(sensors=("vlp16",), heights=(5.0, 12.0)))
    >>> candidates.position_name.tolist(), candidates.xyz.round(6).tolist(), candidates.dropped
    (['lamp 1'], [[20.0, -0.6, 5.0]], {'higher than the pole': 1})
    """
    dropped: dict[str, int] = {}
    foot, axis_offset, top, name, source, on_pole = _positions(geometry, settings, dropped)
    heights = np.array(sorted(set(settings.heights)), dtype=np.float64)
    _check_number(len(foot), len(heights), settings, most)
    position_of = np.repeat(np.arange(len(foot)), len(heights))
    height = np.tile(heights, len(foot))
    xyz = foot[position_of] + axis_offset[position_of]
    xyz[:, 2] += height

    # Each test is made only for poses that passed the earlier ones, so that a dropped pose counts for one reason.
    too_high = height > top[position_of] + _MAX_ABOVE_POLE
    inside = ~too_high
    inside[inside] = inside_any(xyz[inside], geometry.occluders)
    blocked = np.zeros(len(xyz), dtype=bool)
    post = ~on_pole[position_of] & ~inside
    blocked[post] = post_blocked(foot[position_of[post]], height[post], settings.clearance, geometry.occluders)
    dropped["higher than the pole"] = int(too_high.sum())
    dropped["inside an object"] = int(inside.sum())
    dropped["too close to a wall or object"] = int(blocked.sum())
    kept = ~too_high & ~inside & ~blocked
    if not kept.any():
        raise SeipError(_none_left(dropped))

    used, compact = np.unique(position_of[kept], return_inverse=True)
    sensors = np.array(list(dict.fromkeys(settings.sensors)))
    tilts = np.array(sorted(settings.tilts), dtype=np.float64)
    repeat = len(tilts) * len(sensors)
    position_of = np.repeat(compact.astype(np.int64), repeat)
    tilt = np.tile(np.repeat(tilts, len(sensors)), int(kept.sum()))
    groups = _mandatory_groups(geometry, foot[used], name[used])
    return Candidates(
        position=foot[used],
        position_name=name[used],
        on_pole=on_pole[used],
        pole_source=source[used],
        position_of=position_of,
        sensor=np.tile(sensors, int(kept.sum()) * len(tilts)),
        height=np.repeat(height[kept], repeat),
        xyz=np.repeat(xyz[kept], repeat, axis=0),
        yaw=_yaws(tilt, position_of, foot[used], geometry.region),
        tilt=tilt,
        mandatory=np.array([row for _, row in groups], dtype=bool).reshape(len(groups), len(used)),
        mandatory_name=np.array([title for title, _ in groups], dtype=np.str_),
        dropped={reason: count for reason, count in dropped.items() if count},
    )


def _check_number(positions: int, heights: int, settings: CandidateSettings, most: float) -> None:
    tilts, types = len(settings.tilts), len(set(settings.sensors))
    number = positions * heights * tilts * types
    if number > most:
        counts = (counted(positions, "position"), counted(heights, "height"), counted(tilts, "tilt"))
        raise SeipError(
            f"{number:,} candidates ({' × '.join(counts)} × {counted(types, 'sensor type')}) are too many: at most "
            f"{most:,.0f} are possible with the targets of this site; give fewer heights, tilts or types, or larger "
            "spacings of candidates or targets"
        )


def _positions(
    geometry: SceneGeometry, settings: CandidateSettings, dropped: dict[str, int]
) -> tuple[Float, Float, Float, Text, Text, Boolean]:
    """Return foot, offset of the optical centre, top, name, source and kind of each position, sorted by x, y, z."""
    poles = _free_poles(geometry, settings, dropped)
    pole_feet = np.array([pole.base for pole in poles], dtype=np.float64).reshape(-1, 3)
    pavement = _pavement_feet(geometry, settings, pole_feet, dropped)
    foot = np.round(np.concatenate((pavement, pole_feet)), 6)
    offset = np.zeros_like(foot)
    top = np.full(len(foot), np.inf)
    for row, pole in enumerate(poles, start=len(pavement)):
        top[row] = np.inf if pole.height is None else pole.height
        offset[row, :2] = settings.bracket * _towards(pole.base[:2], geometry.region)
    on_pole = np.arange(len(foot)) >= len(pavement)
    order = np.lexsort((foot[:, 2], foot[:, 1], foot[:, 0]))
    numbers = iter(range(1, len(pavement) + 1))
    pole_names = [pole.name for pole in poles]
    names = [pole_names[i - len(pavement)] if on_pole[i] else f"sidewalk {next(numbers)}" for i in order]
    sources = np.array(["" for _ in pavement] + [pole.source for pole in poles], dtype=np.str_)[order]
    text = np.array(names, dtype=np.str_)
    return foot[order], np.round(offset[order], 6), top[order], text, sources, on_pole[order]


def _free_poles(geometry: SceneGeometry, settings: CandidateSettings, dropped: dict[str, int]) -> list[Pole]:
    for pole in geometry.poles:
        if pole.forbidden and pole.mandatory:
            raise SeipError(f"pole {pole.name!r} is both forbidden and mandatory: remove one of the two marks")
    forbidden = _union(geometry.forbidden_areas)
    free = [p for p in geometry.poles if not p.forbidden and not forbidden.intersects(shapely.Point(p.base[:2]))]
    for pole in geometry.poles:
        if pole.mandatory and pole not in free:
            raise SeipError(f"mandatory pole {pole.name!r} stands in a forbidden area: move the area or unmark it")
    dropped["on a forbidden pole"] = len(geometry.poles) - len(free)
    usable = [pole for pole in free if ASSUMED_POLES in settings.allow or pole.mandatory or pole.source != ASSUMED]
    dropped[ON_ASSUMED_POLE] = len(free) - len(usable)
    allowed = []
    for pole in usable:
        if pole.keep_off is None or pole.keep_off in settings.allow or pole.mandatory:
            allowed.append(pole)
        else:
            reason = RULES[pole.keep_off].reason
            dropped[reason] = dropped.get(reason, 0) + 1
    return allowed


def _pavement_feet(
    geometry: SceneGeometry, settings: CandidateSettings, poles: Float, dropped: dict[str, int]
) -> Float:
    """Return the feet (n, 3) of new posts: a maximal sample of the candidate areas at the least distance."""
    area = geometry.candidate_areas
    if area.is_empty:
        return np.empty((0, 3))
    road = outline(joined(geometry.roads))
    free = area.difference(road.buffer(settings.setback)) if not road.is_empty else area
    if len(poles):
        # An existing pole already serves the surroundings of its foot.
        free = free.difference(shapely.union_all(shapely.buffer(shapely.points(poles[:, :2]), settings.spacing / 2)))
    plan = spread(free, settings.spacing)
    forbidden = _union(geometry.forbidden_areas)
    allowed = ~shapely.intersects_xy(forbidden, plan[:, 0], plan[:, 1])
    dropped["in a forbidden area"] = int((~allowed).sum())
    plan = plan[allowed]
    left = np.ones(len(plan), dtype=bool)
    for rule, hit in excluded_posts(plan, geometry.keep_off_areas, road, settings.allow).items():
        dropped[RULES[rule].reason] = dropped.get(RULES[rule].reason, 0) + int(hit.sum())
        left &= ~hit
    plan = plan[left]
    height = surface_height(plan, joined((*geometry.ground, *geometry.roads)))
    supported = np.isfinite(height)
    dropped["over no ground"] = int((~supported).sum())
    return np.column_stack((plan[supported], height[supported]))


def _towards(point: Float, region: BaseGeometry) -> Float:
    """Return the unit vector in plan from a point to the region, or to its centre from within."""
    nearest = shapely.shortest_line(shapely.Point(point), region)
    goal = np.array(nearest.coords[-1])
    if np.hypot(*(goal - point)) < 1e-6:
        goal = np.array(region.centroid.coords[0])
    way = goal - point
    length = np.hypot(*way)
    return way / length if length > 0 else np.array((1.0, 0.0))


def headings(foot: Float, region: BaseGeometry) -> Float:
    """Return the directions (p,) in plan from each foot to the region, or to its centre from within, radians."""
    way = np.array([_towards(point[:2], region) for point in foot])
    return np.round(np.arctan2(way[:, 1], way[:, 0]), 6)


def _yaws(tilt: Float, position_of: Integer, foot: Float, region: BaseGeometry) -> Float:
    """Return the yaw of each pose (c,), radians: zero if upright, otherwise the direction to the region."""
    return np.where(tilt == 0, 0.0, headings(foot, region)[position_of]) if tilt.any() else np.zeros(len(tilt))


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
                "enlarge it, remove forbidden areas and obstacles from it, or use lower heights"
            )
    return groups


def assumed_pole_warnings(geometry: SceneGeometry, candidates: Candidates) -> tuple[str, ...]:
    """Return a warning with the number of assumed poles in a scene, and whether they may carry sensors."""
    assumed = sum(pole.source == ASSUMED for pole in geometry.poles)
    if not assumed:
        return ()
    poles = counted(assumed, "pole is", "poles are")
    if (candidates.pole_source == ASSUMED).any():
        return (f"{poles} assumed, not from the map, and may carry sensors: make sure that they exist",)
    carry = "carries" if assumed == 1 else "carry"
    return (f"{poles} assumed, not from the map, and {carry} no sensors: allow assumed poles to use them",)


def _union(areas: Sequence[NamedArea]) -> BaseGeometry:
    union = shapely.union_all([area.polygon for area in areas])
    shapely.prepare(union)
    return union


def _none_left(dropped: dict[str, int]) -> str:
    reasons = ", ".join(f"{count} {reason}" for reason, count in dropped.items() if count)
    cure = "enlarge SEIP Candidate Areas, add SEIP Poles, or reduce set-back and clearance"
    rules = [name for name, rule in RULES.items() if dropped.get(rule.reason)]
    if rules:
        cure += f", or allow {' '.join(rules)}"
    return f"no candidate is left ({reasons}): {cure}" if reasons else f"no candidate: {cure}"
