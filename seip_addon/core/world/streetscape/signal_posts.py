"""Posts of a map's traffic lights: those of the map, or assumed ones next to the carriageway."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ...base.arrays import Float
from ...site.roles import Role
from ...site.scene_geometry import ASSUMED, FROM_MAP
from ..opendrive.objects import PlacedObject, PlacedSignal
from . import street_furniture
from .map_furniture import arm_heading, can_carry
from .object_kinds import SIGNAL_WORDS, WORDS_OF_KIND, Kind, Post, post_of, words_of
from .parts import Part
from .road_surface import Roadside
from .terrain import Terrain

DEFAULT_HEIGHT = 6.0  # metres: assumed height of a post
MAST_ARM, MAX_ARM = 4.5, 12.0
MIN_HEIGHT_FOR_ARM = 4.5  # metres: lower posts have no arm over traffic
KERB_CLEARANCE = 0.6
SAME_POLE_DISTANCE = 3.0
"""Metres: signals with poles nearer to each other share one, and a post of any kind within this carries a signal."""
MAST_REACH = 12.0  # metres within which a post named after signals carries one


@dataclass(frozen=True, eq=False)
class _SignalPost:
    """A post with the heading (radians) and length (metres) of its arm; for the source see `Part`."""

    foot: Float
    heading: float
    arm: float
    height: float
    faces_left: bool
    source: str
    carries: bool


def split_posts(
    objects: Sequence[PlacedObject], signals: Iterable[PlacedSignal], roadside: Roadside
) -> tuple[list[PlacedObject], list[tuple[PlacedSignal, Post | None]]]:
    """Divide a map's objects into posts that carry traffic lights and others.

    Parameters
    ----------
    objects : sequence of PlacedObject
        Objects in local axes.
    signals : iterable of PlacedSignal
        Signals in local axes.
    roadside : Roadside
        Carriageway and its sides.

    Returns
    -------
    others : list of PlacedObject
        Objects that carry no signal.
    lights : list of (PlacedSignal, Post or None)
        Signals, each with its post.
    """
    posts = [(number, post) for number, placed in enumerate(objects) if (post := post_of(placed)) is not None]
    used: set[int] = set()
    lights: list[tuple[PlacedSignal, Post | None]] = []
    for signal in signals:
        number, own = _own_post(signal, posts, roadside)
        used |= {number} if own else set()
        lights.append((signal, own))
    return [placed for number, placed in enumerate(objects) if number not in used], lights


def signal_parts(
    lights: Iterable[tuple[PlacedSignal, Post | None]], roadside: Roadside, terrain: Terrain
) -> tuple[Part, ...]:
    """Return the posts of traffic lights, with their heads and arms.

    Posts of the map keep their position. Without one, a signal next to the carriageway stands on a post at its place,
    and a signal above it is mounted on an arm from the nearest place next to it. Heights of signals in the map are not
    used, because maps have posts below the road and lamps above it.

    Parameters
    ----------
    lights : iterable of (PlacedSignal, Post or None)
        Signals in local axes with their posts: see `split_posts`.
    roadside : Roadside
        Carriageway and its sides.
    terrain : Terrain
        Heights of the ground at the posts.
    """
    poles: list[_SignalPost] = []
    for signal, own in lights:
        pole = _post_for(signal, own, roadside)
        if all(np.hypot(*(pole.foot - other.foot)) > SAME_POLE_DISTANCE for other in poles):
            poles.append(pole)
    parts = []
    for number, pole in enumerate(poles, start=1):
        shape = street_furniture.signal_pole(pole.height, pole.arm, faces_left=pole.faces_left)
        x, y = pole.foot.tolist()
        z = float(terrain.height(pole.foot[None])[0])
        role = Role.POLES if pole.carries else Role.OCCLUDERS
        name = f"{'Assumed signal' if pole.source == ASSUMED else 'Signal'} pole {number}"
        parts.append(Part(name, shape, (role,), (x, y, z), pole.heading, source=pole.source))
    return tuple(parts)


def _own_post(signal: PlacedSignal, posts: Sequence[tuple[int, Post]], roadside: Roadside) -> tuple[int, Post | None]:
    """Return the index and the nearest post of the map that can carry the signal; (-1, None) without one."""
    xy = signal.position[:2]
    overhead = roadside.filled.contains(shapely.Point(xy))

    def reach(post: Post) -> float:
        named = post.words & SIGNAL_WORDS and not post.is_lamp
        return MAST_REACH if named or (overhead and not post.is_lamp and can_carry(post)) else SAME_POLE_DISTANCE

    # The reach depends on the post: named after signals, or strong enough for an arm to a signal over the road, it may
    # be far away; any other post must stand at the signal.
    near = [(float(np.hypot(*(post.xy - xy))), number, post) for number, post in posts]
    eligible = [entry for entry in near if entry[0] <= reach(entry[2])]
    if not eligible:
        return -1, None
    _, number, post = min(eligible, key=lambda entry: entry[:2])
    return number, post


def _post_for(signal: PlacedSignal, own: Post | None, roadside: Roadside) -> _SignalPost:
    xy = signal.position[:2]
    overhead = bool(roadside.filled.contains(shapely.Point(xy)))
    height, carries = DEFAULT_HEIGHT, True
    if own is not None:
        foot, source = own.xy, FROM_MAP
        height, carries = own.height or DEFAULT_HEIGHT, can_carry(own)
    elif overhead:
        foot, source = _beside(xy, roadside), ASSUMED
    else:
        named = words_of(signal.name) & WORDS_OF_KIND[Kind.POST]
        foot, source = xy, FROM_MAP if named else ASSUMED
    heading, arm = _arm(foot, xy, signal.yaw, roadside, overhead=overhead)
    faces_left = math.sin(signal.yaw + math.pi - heading) >= 0  # lamps face oncoming traffic
    return _SignalPost(foot, heading, arm if height >= MIN_HEIGHT_FOR_ARM else 0.0, height, faces_left, source, carries)


def _beside(xy: Float, roadside: Roadside) -> Float:
    """Return the nearest place to a point (2,) at the side of the carriageway, not across its end."""
    kerb = shapely.boundary(roadside.filled.buffer(KERB_CLEARANCE, join_style="mitre"))
    sides = kerb.difference(roadside.mouths.buffer(1.02 * KERB_CLEARANCE, cap_style="square"))
    line = shapely.shortest_line(shapely.Point(xy), kerb if sides.is_empty else sides)
    place: Float = shapely.get_coordinates(line)[1]
    return place


def _arm(foot: Float, xy: Float, travel: float, roadside: Roadside, *, overhead: bool) -> tuple[float, float]:
    """Return heading (radians) and length (metres) of the arm of a post; zero length if it would not reach a lane."""
    towards = arm_heading(foot, roadside.carriageway)
    # Of both directions square to the traffic, take the one that points towards the carriageway.
    across = travel + math.pi / 2  # the arm is square to the traffic
    square = across if math.cos(across - towards) >= 0 else across + math.pi
    way = xy - foot
    if overhead and np.hypot(*way) > 0:
        heading, length = math.atan2(way[1], way[0]), round(max(float(np.hypot(*way)), 1.0), 1)
    else:
        heading, length = square, MAST_ARM
    tip = foot + length * np.array([math.cos(heading), math.sin(heading)])
    reaches = length <= MAX_ARM and roadside.carriageway.covers(shapely.Point(tip))
    return heading, length if reaches else 0.0
