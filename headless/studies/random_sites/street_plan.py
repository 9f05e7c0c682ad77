"""Plans of random junctions: arms, lanes, slopes, and objects next to the streets."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from seip_addon.core.base.arrays import Float

Random = np.random.Generator
Tags = Mapping[str, str]

ARM_SHARES = {3: 0.3, 4: 0.5, 5: 0.2}  # shares of junctions by the number of arms
MIN_ANGLES = {3: 70.0, 4: 58.0, 5: 52.0}  # least degrees between two arms, by the number of arms
ARM_LENGTH = (150.0, 200.0)  # metres from the middle
MAX_BEND = 12.0  # largest angle in degrees between the first and the last direction of an arm
STRAIGHT, NODE_SPACING = 25.0, 2.5  # metres of an arm before it bends, and between its nodes: few show as kinks
MAX_SLOPE = 0.06
FLAT_RADIUS = 16.0  # metres about the middle within which the ground is level
RAMP = 24.0  # metres beyond that over which arms reach their slope
ROUNDABOUT_SHARE, LEFT_HAND_SHARE, LEVEL_SHARE = 0.18, 0.35, 0.25
SIGNALS_SHARE = 0.6  # of junctions that are not roundabouts
TURN_LANE_SHARE, CYCLE_LANE_SHARE = 0.4, 0.3  # of arms
TURN_LANE_LENGTH = 45.0  # metres from the middle
LANES = {1: 0.5, 2: 0.37, 3: 0.13}  # shares of lanes in each direction
LANE_WIDTH, KERB_LANE = (2.9, 3.6), (2.4, 2.9)  # metres
KERB_LANE_SHARE = 0.6  # of arms
SIDEWALK, CYCLE_LANE = 2.5, 1.5  # metres, as the builder lays them
CLEARANCE = 0.6  # metres between pavements and the objects behind them
BUILT_REACH = 125.0  # largest distance of objects along a street from the middle, metres
_NAMES = ("Alder", "Birch", "Cedar", "Elm", "Hazel")
_SAME_LANES = 0.8  # share of arms with equal numbers of lanes out and in
_BETWEEN = 1.0  # metres between a building and a wall
_ROOM = {"tree": 1.6, "street_lamp": 0.3, "bus_stop": 4.0}  # metres to the next building or wall
_CITY_SHARE, _VACANT_SHARE = 0.55, 0.15
_WALLED_SHARE, _SHORTEST_WALL = 0.45, 4.0
_GREEN_SHARE, _TREE_SHARE = 0.5, 0.85
_SHELTER_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class Arm:
    """A street that leads to the junction.

    Parameters
    ----------
    line : (k, 2) float64, metres
        Centre line, from the junction outwards.
    lanes_in, lanes_out : int
        Numbers of lanes towards the junction and away from it.
    lane_width : float, metres
    turn_lane : bool
        Whether an additional lane towards the junction begins `TURN_LANE_LENGTH` before it.
    kerb_lane : float, metres
        Width of an additional lane away from the junction with parking at its kerb; 0 without one.
    cycle_lanes : bool
    slope : float
        Rise per metre, away from the junction.
    """

    name: str
    kind: str
    line: Float
    lanes_in: int
    lanes_out: int
    lane_width: float
    turn_lane: bool
    kerb_lane: float
    cycle_lanes: bool
    slope: float

    @property
    def half_width(self) -> float:
        """Half of the largest width with pavements, metres."""
        inwards = (self.lanes_in + self.turn_lane) * self.lane_width
        outwards = self.lanes_out * self.lane_width + self.kerb_lane
        return max(inwards, outwards) + CYCLE_LANE * self.cycle_lanes + SIDEWALK

    @property
    def angle(self) -> float:
        """Direction in which it leaves the junction, radians."""
        x, y = self.line[1] - self.line[0]
        return math.atan2(y, x)


@dataclass(frozen=True, eq=False)
class Thing:
    """An object next to the streets: a point, line or closed outline (k, 2), and its tags."""

    corners: Float
    tags: Tags
    closed: bool = False


@dataclass(frozen=True, eq=False)
class StreetPlan:
    """A junction with its surroundings, in metres east and north of its middle.

    Parameters
    ----------
    roundabout : float or None, metres
        Radius of the centre line of its carriageway; None without a roundabout.
    """

    arms: tuple[Arm, ...]
    roundabout: float | None
    signals: bool
    left_hand: bool
    things: tuple[Thing, ...]

    def height(self, places: Float) -> Float:
        """Return the height (n,) of the ground at positions (n, 2), metres: level in the middle, sloped along each arm.

        Between two arms, the slope changes smoothly from one to the other.
        """
        distance = np.hypot(*places.T)
        past = np.maximum(distance - FLAT_RADIUS, 0.0)
        ramped = np.where(past < RAMP, past**2 / (2.0 * RAMP), past - RAMP / 2.0)
        heights: Float = ramped * self._slope(np.arctan2(places[:, 1], places[:, 0]))
        return heights

    def _slope(self, direction: Float) -> Float:
        angles = np.array([math.atan2(arm.line[-1, 1], arm.line[-1, 0]) for arm in self.arms]) % math.tau
        order = np.argsort(angles)
        at = np.concatenate([[angles[order[-1]] - math.tau], angles[order], [angles[order[0]] + math.tau]])
        slopes = np.array([self.arms[number].slope for number in (order[-1], *order, order[0])])
        turn = direction % math.tau
        before = np.clip(np.searchsorted(at, turn, side="right") - 1, 0, len(at) - 2)
        share = (turn - at[before]) / (at[before + 1] - at[before])
        share = 0.5 - 0.5 * np.cos(math.pi * share)
        mixed: Float = slopes[before] + share * (slopes[before + 1] - slopes[before])
        return mixed

    def streets(self) -> BaseGeometry:
        """Return the area of carriageways and pavements."""
        widest = max(arm.half_width for arm in self.arms)
        middle = shapely.Point(0.0, 0.0).buffer(widest + 5.0 if self.roundabout is None else self.roundabout + 9.0)
        return shapely.union_all([middle, *(shapely.LineString(arm.line).buffer(arm.half_width) for arm in self.arms)])


def draw_plan(random: Random) -> StreetPlan:
    """Draw a junction with its surroundings."""
    arms = _draw_arms(random)
    roundabout = None
    if random.random() < ROUNDABOUT_SHARE:
        roundabout = float(random.uniform(13.0, 18.0))
        arms = tuple(_at_roundabout(arm) for arm in arms)
    signals = roundabout is None and random.random() < SIGNALS_SHARE
    bare = StreetPlan(arms, roundabout, signals, random.random() < LEFT_HAND_SHARE, ())
    things = tuple(_draw_things(bare, random))
    return StreetPlan(arms, roundabout, signals, bare.left_hand, things)


def with_tram(plan: StreetPlan) -> StreetPlan:
    """Return a plan with tracks of a tram along the main street."""
    first, second = (arm.line for arm in plan.arms if arm.name == "Main Street")
    tracks = Thing(np.concatenate([first[:0:-1], second]), {"railway": "tram"})
    return replace(plan, things=(*plan.things, tracks))


def _draw_arms(random: Random) -> tuple[Arm, ...]:
    count = int(random.choice(list(ARM_SHARES), p=list(ARM_SHARES.values())))
    gaps = MIN_ANGLES[count] + (360.0 - count * MIN_ANGLES[count]) * random.dirichlet(np.full(count, 4.0))
    angles = np.radians(random.uniform(0.0, 360.0) + np.cumsum(gaps))
    steepest = 0.0 if random.random() < LEVEL_SHARE else float(random.uniform(0.015, MAX_SLOPE))
    slopes = steepest * random.uniform(-1.0, 1.0, count)
    slopes[random.integers(count)] = steepest * random.choice([-1.0, 1.0])
    main = set(random.permutation(count)[:2].tolist())  # two arms are the main street
    lanes_of_main = _draw_lanes(random)
    arms = []
    for number, (angle, slope) in enumerate(zip(angles.tolist(), slopes.tolist(), strict=True)):
        is_main = number in main
        lanes = lanes_of_main if is_main else min(_draw_lanes(random), lanes_of_main)
        arms.append(
            Arm(
                name="Main Street" if is_main else f"{_NAMES[number]} Street",
                kind="secondary" if is_main else "residential",
                line=_draw_line(angle, random),
                lanes_in=lanes,
                lanes_out=lanes if random.random() < _SAME_LANES else max(lanes - 1, 1),
                lane_width=round(float(random.uniform(*LANE_WIDTH)), 2),
                kerb_lane=round(float(random.uniform(*KERB_LANE)), 2) if random.random() < KERB_LANE_SHARE else 0.0,
                turn_lane=lanes < max(LANES) and random.random() < TURN_LANE_SHARE,
                cycle_lanes=random.random() < CYCLE_LANE_SHARE,
                slope=slope,
            )
        )
    return tuple(arms)


def _draw_lanes(random: Random) -> int:
    return int(random.choice(list(LANES), p=list(LANES.values())))


def _draw_line(angle: float, random: Random) -> Float:
    """Return the centre line of an arm: straight at first, then bending to one side."""
    length = float(random.uniform(*ARM_LENGTH))
    bend = math.radians(MAX_BEND) * float(random.uniform(-1.0, 1.0))
    along = np.concatenate([np.arange(0.0, length, NODE_SPACING), [length]])
    turned = angle + bend * np.clip((along - STRAIGHT) / (length - STRAIGHT), 0.0, 1.0) ** 2
    line: Float = along[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
    return line


def _at_roundabout(arm: Arm) -> Arm:
    """Return an arm with one lane in each direction, as roundabouts have."""
    return replace(arm, lanes_in=1, lanes_out=1, turn_lane=False)


def _draw_things(plan: StreetPlan, random: Random) -> Iterator[Thing]:
    streets = plan.streets()
    buildings = list(_draw_buildings(plan, streets, random))
    yield from buildings
    taken = shapely.union_all([shapely.Polygon(one.corners) for one in buildings])
    free = shapely.union_all([streets, taken.buffer(_BETWEEN)])
    walls = list(_draw_walls(plan, free, random))
    yield from walls
    lines = shapely.union_all([shapely.LineString(one.corners) for one in walls])
    for one in (*_draw_trees(plan, random), *_draw_lamps(plan, random), *_draw_shelters(plan, random)):
        spot = shapely.Point(one.corners[0])
        room = _ROOM[one.tags.get("natural", one.tags.get("highway", ""))]
        if spot.distance(taken) > room and spot.distance(lines) > room and spot.distance(streets) > 0.0:
            yield one


def _frames(arm: Arm, first: float, spacing: float) -> Iterator[tuple[float, Float, Float]]:
    """Yield distance, position and direction at points along an arm."""
    line = shapely.LineString(arm.line)
    for along in np.arange(first, min(line.length, BUILT_REACH), spacing).tolist():
        here, next_ = (shapely.get_coordinates(line.interpolate(along + step))[0] for step in (0.0, 0.5))
        yield along, here, (next_ - here) / np.hypot(*(next_ - here))


def _sides(plan: StreetPlan) -> Iterator[tuple[Arm, float]]:
    """Yield both sides of each arm: 1 is to the left, seen from the junction."""
    yield from itertools.product(plan.arms, (1.0, -1.0))


def _beside(place: Float, ahead: Float, distance: float) -> Float:
    left: Float = place + distance * np.array([-ahead[1], ahead[0]])
    return left


def _draw_buildings(plan: StreetPlan, streets: BaseGeometry, random: Random) -> Iterator[Thing]:
    """Yield buildings along the streets: terraces, or detached houses with random gaps."""
    taken: list[shapely.Polygon] = []
    keep_clear = streets.buffer(CLEARANCE)
    shapely.prepare(keep_clear)
    is_city = random.random() < _CITY_SHARE
    usual_levels = int(random.integers(3, 7) if is_city else random.integers(1, 4))
    for arm, side in _sides(plan):
        line = shapely.LineString(arm.line)
        set_back = float(random.uniform(0.8, 3.0) if is_city else random.uniform(3.0, 10.0))
        along = float(random.uniform(10.0, 25.0))
        while along < BUILT_REACH:
            width = float(random.uniform(12.0, 26.0) if is_city else random.uniform(8.0, 15.0))
            if random.random() > _VACANT_SHARE:
                depth = float(random.uniform(9.0, 14.0))
                outline = _lot(line, along, width, side * (arm.half_width + set_back), side * depth)
                if not keep_clear.intersects(outline) and not any(outline.intersects(one) for one in taken):
                    taken.append(outline.buffer(0.2))
                    yield Thing(
                        shapely.get_coordinates(outline)[:-1], _building_tags(usual_levels, random), closed=True
                    )
            along += width + (float(random.choice([0.3, 6.0], p=[0.8, 0.2])) if is_city else random.uniform(3.0, 10.0))


def _lot(line: shapely.LineString, along: float, width: float, front: float, depth: float) -> shapely.Polygon:
    """Return a rectangle with its front along a street, ``front`` metres to the left."""
    begin, end = (shapely.get_coordinates(line.interpolate(place))[0] for place in (along, along + width))
    ahead = (end - begin) / max(float(np.hypot(*(end - begin))), 1e-9)
    corners = [_beside(begin, ahead, front), _beside(begin + width * ahead, ahead, front)]
    return shapely.Polygon([*corners, *(_beside(corner, ahead, depth) for corner in reversed(corners))])


def _building_tags(usual_levels: int, random: Random) -> dict[str, str]:
    levels = max(usual_levels + int(random.integers(-1, 2)), 1)
    tags = {"building": "yes", "height": f"{3.1 * levels + random.uniform(0.5, 3.5):.1f}"}
    shape = str(random.choice(["flat", "gabled", "hipped"], p=[0.4, 0.4, 0.2]))
    return tags if shape == "flat" else tags | {"roof:shape": shape, "roof:height": f"{random.uniform(1.5, 3.0):.1f}"}


def _draw_walls(plan: StreetPlan, taken: BaseGeometry, random: Random) -> Iterator[Thing]:
    """Yield walls, hedges and fences behind the pavement where there is space."""
    for arm, side in _sides(plan):
        if random.random() > _WALLED_SHARE:
            continue
        distance = side * (arm.half_width + CLEARANCE + float(random.uniform(0.2, 1.0)))
        parallel = shapely.get_parts(shapely.LineString(arm.line).offset_curve(distance))
        line = max(parallel, key=lambda part: part.length)
        begin = float(random.uniform(20.0, 60.0))
        stretch = substring(line, begin, begin + float(random.uniform(15.0, 60.0)))
        for part in shapely.get_parts(shapely.difference(stretch, taken)):
            if part.length > _SHORTEST_WALL:
                yield Thing(shapely.get_coordinates(part), _wall_tags(random))


def _wall_tags(random: Random) -> dict[str, str]:
    kind = str(random.choice(["wall", "hedge", "fence"]))
    return {"barrier": kind, "height": f"{random.uniform(0.8, 2.2):.1f}"}


def _draw_trees(plan: StreetPlan, random: Random) -> Iterator[Thing]:
    """Yield rows of trees behind the pavements."""
    for arm, side in _sides(plan):
        if random.random() > _GREEN_SHARE:
            continue
        height, spacing = float(random.uniform(4.5, 13.0)), float(random.uniform(8.0, 16.0))
        for _, place, ahead in _frames(arm, float(random.uniform(18.0, 35.0)), spacing):
            own = height * float(random.uniform(0.8, 1.2))
            tags = {"natural": "tree", "height": f"{own:.1f}"}
            tags["diameter_crown"] = f"{min(own * random.uniform(0.35, 0.6), 6.5):.1f}"
            if random.random() < _TREE_SHARE:
                aside = arm.half_width + float(random.uniform(0.7, 1.3))
                yield Thing(_beside(place, ahead, side * aside)[None], tags)


def _draw_lamps(plan: StreetPlan, random: Random) -> Iterator[Thing]:
    """Yield street lamps at the outer edge of the pavements, on alternating sides."""
    height = f"{random.uniform(5.5, 9.0):.1f}"
    for arm in plan.arms:
        spacing = float(random.uniform(20.0, 32.0))
        side = float(random.choice([-1.0, 1.0]))
        for _, place, ahead in _frames(arm, arm.half_width + float(random.uniform(8.0, 14.0)), spacing):
            side = -side
            spot = _beside(place, ahead, side * (arm.half_width + 0.3))
            yield Thing(spot[None], {"highway": "street_lamp", "height": height})


def _draw_shelters(plan: StreetPlan, random: Random) -> Iterator[Thing]:
    for arm, side in _sides(plan):
        if random.random() < _SHELTER_SHARE:
            _, place, ahead = next(_frames(arm, float(random.uniform(35.0, 75.0)), 10.0))
            spot = _beside(place, ahead, side * (arm.half_width + 0.3))
            yield Thing(spot[None], {"highway": "bus_stop", "shelter": "yes"})
