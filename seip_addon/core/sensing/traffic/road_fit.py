"""Fit of road users to the road surface of a scene: heights, slopes, and removal where there is no road.

SUMO's pedestrians are smoothed: they jump by a metre or two at the beginning of a crossing, and turn on the spot.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely

from ...base.arrays import Boolean, Float, Integer
from ...base.counts import counted
from ...base.errors import SeipError
from ...geometry.plan import MIN_AREA, heights_over, plane_height, signed_area
from ...site.scene_geometry import SceneGeometry, joined
from .floating_car_data import listed, unwrapped
from .trajectories import LoadedTraffic, RoadUser, Trajectories

WHEELBASE_SHARE = 0.6  # wheelbase as a share of a vehicle's length: its pitch is that of the road between the axles
MAX_GAP = 2.5  # sampling intervals; if samples are farther apart, the road user was elsewhere in between
WINDOW_SECONDS = 1.8  # seconds over which a pedestrian's position and heading are averaged
MAX_LEAP = 4.0  # metres beyond what the speed explains; after a longer step a road user was moved elsewhere

_DIGITS = {"time": 3, "position": 3, "yaw": 4, "pitch": 4, "speed": 2}
"""Decimal places of each array: a millimetre and a ten-thousandth of a radian, the precision of simulations."""

ROAD_TOLERANCE = 1.0
"""Largest distance in plan, metres, between the centre of a road user that is on the road and the road.

A bus of 12 m, which simulations move like a rod on its lane, cuts a tight corner by up to this distance.
"""


class RoadSurface:
    """Triangles (n, 3, 3) that road users can stand on."""

    def __init__(self, triangles: Float) -> None:
        self._triangles = triangles[np.abs(signed_area(triangles)) > MIN_AREA]
        self._tree = shapely.STRtree(shapely.polygons(self._triangles[:, :, :2]))

    def height(self, plan: Float, hint: Float) -> Float:
        """Return the height (n,) of the surface at points (n, 2), nearest to a hint (n,); NaN off the road."""
        point, heights = heights_over(plan, self._triangles)
        height = _nearest_heights(len(plan), point, heights, hint)
        beside = np.flatnonzero(np.isnan(height))
        places = shapely.points(plan[beside])
        number, triangle = self._tree.query_nearest(places, max_distance=ROAD_TOLERANCE)
        nearest = shapely.get_coordinates(
            shapely.get_point(shapely.shortest_line(self._tree.geometries[triangle], places[number]), 0)
        )
        heights = plane_height(self._triangles[triangle], nearest)
        height[beside] = _nearest_heights(len(beside), number, heights, hint[beside])
        return height


def _nearest_heights(count: int, point: Integer, heights: Float, hint: Float) -> Float:
    """Return for each point the height that is nearest to its hint, or the highest if the hint is NaN."""
    wanted = np.where(np.isnan(hint[point]), np.inf, hint[point])
    badness = np.where(np.isinf(wanted), -heights, np.abs(heights - wanted))
    order = np.lexsort((badness, point))
    first = np.unique(point[order], return_index=True)[1]
    height = np.full(count, np.nan)
    height[point[order][first]] = heights[order][first]
    return height


def fit_to_road(trajectories: Trajectories, geometry: SceneGeometry) -> LoadedTraffic:
    """Fit road users to the road of a scene, leaving out samples off the road.

    Vehicles stand on roads, pedestrians on roads and pavements. If surfaces lie above one another, the one nearest to
    the height in the trajectories is used, or the highest if there is no height. A road user who leaves the road or the
    scene and comes back, or whom the simulation moves elsewhere, becomes another road user: NAME/2.

    Parameters
    ----------
    trajectories : Trajectories
        Trajectories whose heights may be NaN.

    Returns
    -------
    LoadedTraffic
        Trajectories in the local axes of the scene, rounded to the millimetre, with pitches.

    Raises
    ------
    SeipError
        No road user comes near the region of interest, or most of those who do are off the road: the traffic belongs to
        another map.
    """
    local = trajectories.moved_to(geometry.origin)
    roads = RoadSurface(joined(geometry.roads))
    both = RoadSurface(joined((*geometry.roads, *geometry.ground)))
    user = np.repeat(np.arange(len(local)), np.diff(local.first))
    walks = np.array([each.category == "pedestrian" for each in local.users], dtype=np.bool_)[user]

    def height(plan: Float, hint: Float) -> Float:
        found = np.empty(len(plan))
        found[~walks] = roads.height(plan[~walks], hint[~walks])
        found[walks] = both.height(plan[walks], hint[walks])
        return found

    plan = local.position[:, :2]
    z = height(plan, local.position[:, 2])
    on_road = np.isfinite(z)
    hull = geometry.region.convex_hull
    near = shapely.contains_xy(hull, plan[:, 0], plan[:, 1])
    warnings = _off_the_road(local, user, near, on_road)
    length = np.array([each.length for each in local.users])[user]
    pitch = np.where(walks, 0.0, _pitch(height, plan, z, local.yaw, length))
    fitted = replace(local, position=np.column_stack([plan, z]), pitch=pitch)
    return LoadedTraffic(_rounded(_without_gaps(fitted, user, on_road)), warnings)


def smooth_walks(trajectories: Trajectories) -> Trajectories:
    """Return the trajectories with pedestrians' positions in plan and headings averaged over `WINDOW_SECONDS`.

    At the ends of a walk, and where a pedestrian was moved elsewhere, the window is shortened to the available samples.
    """
    position, yaw = trajectories.position.copy(), trajectories.yaw.copy()
    leaps = np.flatnonzero(_out_of_reach(trajectories)) + 1
    for user, begin, end in zip(trajectories.users, trajectories.first[:-1], trajectories.first[1:], strict=True):
        if user.category != "pedestrian" or end - begin < 3:
            continue
        reach = round(WINDOW_SECONDS / 2.0 / float(np.median(np.diff(trajectories.time[begin:end]))))
        for part in np.split(np.arange(begin, end), leaps[(begin < leaps) & (leaps < end)] - begin):
            position[part, :2] = _averaged(position[part, :2], reach)
            yaw[part] = _averaged(yaw[part, None], reach)[:, 0]
    return replace(trajectories, position=position, yaw=yaw)


def _pitch(height: Callable[[Float, Float], Float], plan: Float, z: Float, yaw: Float, length: Float) -> Float:
    """Return the slope of the road between the axles, radians; the middle replaces an axle that is off the road."""
    half = WHEELBASE_SHARE / 2.0 * length
    ahead = half[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    front, rear = height(plan + ahead, z), height(plan - ahead, z)
    rise = np.where(np.isnan(front), z, front) - np.where(np.isnan(rear), z, rear)
    run = half * (np.isfinite(front).astype(float) + np.isfinite(rear))
    pitch: Float = np.where(run > 0.0, np.arctan2(rise, np.where(run > 0.0, run, 1.0)), 0.0)
    return pitch


def _off_the_road(local: Trajectories, user: Integer, near: Boolean, on_road: Boolean) -> tuple[str, ...]:
    """Return warnings about road users off the road near the region; raise SeipError if most are."""
    count = len(local)
    seen = np.bincount(user[near], minlength=count)
    off = np.bincount(user[near & ~on_road], minlength=count)
    visitors = int(np.count_nonzero(seen))
    if not visitors:
        raise SeipError(
            f"FCD of another map: {counted(count, 'road user')}, none in the region of interest; "
            "simulate on the scene's own map, and name its .net.xml where that has a netOffset"
        )
    astray = [local.users[number].name for number in np.flatnonzero(off)]
    mostly = int(np.count_nonzero(off > seen / 2.0))
    if mostly > visitors / 2.0:
        raise SeipError(
            f"FCD of another map: {mostly} of {counted(visitors, 'road user')} in the region of interest "
            f"{'is' if mostly == 1 else 'are'} off the road, by more than {ROAD_TOLERANCE:g} m "
            f"({listed(astray)}); simulate on the scene's own map, and name its .net.xml where that has a netOffset"
        )
    if not astray:
        return ()
    sentence = (
        f"{len(astray)} of {counted(visitors, 'road user')} {'leaves' if len(astray) == 1 else 'leave'} the road by "
        f"more than {ROAD_TOLERANCE:g} m and {'is' if len(astray) == 1 else 'are'} left out there: {listed(astray)}"
    )
    return (sentence,)


def _without_gaps(trajectories: Trajectories, user: Integer, keep: Boolean) -> Trajectories:
    """Keep some samples; a gap divides a road user into two, and a single sample is dropped."""
    kept = np.flatnonzero(keep)
    user, time = user[kept], trajectories.time[kept]
    new = np.ones(len(kept), dtype=np.bool_)
    new[1:] = (np.diff(user) != 0) | (np.diff(kept) > 1) | (np.diff(time) > _longest_gap(trajectories))
    new[1:] |= _out_of_reach(trajectories)[kept[1:] - 1]
    begin = np.flatnonzero(new)
    end = np.append(begin[1:], len(kept))
    stays = end - begin > 1
    begin, end = begin[stays], end[stays]
    if not len(begin):
        raise SeipError("no road user is on the road of the scene for two samples; simulate more of its traffic")
    chosen = kept[np.concatenate([np.arange(a, b) for a, b in zip(begin, end, strict=True)])]
    first = np.concatenate([[0], np.cumsum(end - begin)])
    owner = user[begin]
    visit = np.arange(len(owner)) - np.searchsorted(owner, owner)
    return replace(
        trajectories,
        users=tuple(_visit(trajectories.users[a], b) for a, b in zip(owner.tolist(), visit.tolist(), strict=True)),
        first=first.astype(np.int64),
        time=trajectories.time[chosen],
        position=trajectories.position[chosen],
        yaw=unwrapped(trajectories.yaw[chosen], first),
        pitch=trajectories.pitch[chosen],
        speed=trajectories.speed[chosen],
    )


def _longest_gap(trajectories: Trajectories) -> float:
    """Return the longest time in seconds between two samples of one stay."""
    steps = np.delete(np.diff(trajectories.time), trajectories.first[1:-1] - 1)
    return MAX_GAP * float(np.median(steps)) if len(steps) else 0.0


def _visit(user: RoadUser, visit: int) -> RoadUser:
    return user if visit == 0 else replace(user, name=f"{user.name}/{visit + 1}")


def _rounded(trajectories: Trajectories) -> Trajectories:
    arrays = {name: np.round(getattr(trajectories, name), digits) + 0.0 for name, digits in _DIGITS.items()}
    return replace(trajectories, **arrays)


def _out_of_reach(trajectories: Trajectories) -> Boolean:
    """Return whether each of the n samples except the first, (n - 1,) bool, is out of reach from the one before.

    Speeds up to 1.5 times those at the two samples are possible. The first sample of a road user is compared with the
    last one of the road user before; that result has no meaning.
    """
    step = np.hypot(*np.diff(trajectories.position[:, :2], axis=0).T)
    speed = np.maximum(trajectories.speed[1:], trajectories.speed[:-1])
    leaps: Boolean = step > 1.5 * speed * np.abs(np.diff(trajectories.time)) + MAX_LEAP
    return leaps


def _averaged(values: Float, reach: int) -> Float:
    """Return the mean (n, d) of each row and ``reach`` rows on either side, or fewer where one side has fewer."""
    count = len(values)
    number = np.arange(count)
    reach_here = np.minimum(np.minimum(number, count - 1 - number), reach)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values - values[0], axis=0)])
    total = sums[number + reach_here + 1] - sums[number - reach_here]
    mean: Float = values[0] + total / (2 * reach_here + 1)[:, None]
    return mean
