r"""Expected number of returns of a LiDAR from road users.

Let a panel of width w, height h and reflectivity :math:`ρ` stand at horizontal distance d from the sensor and rise from
:math:`z_0` above it (`bodies`). A ray of azimuth φ and elevation ε meets it where

.. math::
    |φ - φ_0| \le \arcsin\frac{w}{2d}, \qquad z_0 \le d \tan ε \le z_0 + h,

at the range :math:`r = d / \cos ε`. The return is detected with the probability :math:`P(r, ρ \cos ε)` of the sensor's
law, unless the ray is stopped before by the static scene, at a horizontal distance below d. The expected number is

.. math::
    R = \sum_{\text{free rays on the panel}} P(r, ρ \cos ε).

All rays of a channel have the same elevation, so that P is the same for all rays of a channel on a panel, and these
rays are neighbours. Rays that meet some panel are cast once for all panels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float, Integer, concatenated_ranges
from ..lidar.beam_windows import channels_between, steps_in_arcs
from ..lidar.beams import BeamPattern
from ..lidar.model import LidarModel
from ..visibility.ray_casting import RayCaster
from ..visibility.visibility_model import is_upright, yaw_of
from .bodies import PANELS
from .road_users import BODIES, RoadUsers

_PAIRS_AT_ONCE = 1 << 21  # pairs of rays and panels in a batch; bounds the memory if rays have no neighbours


@dataclass(frozen=True, eq=False)
class PanelRows:
    """The m panels as seen from a sensor at the origin.

    Parameters
    ----------
    distance : (m,) float64, metres
        Horizontal distance, at least half the width.
    azimuth : (m,) float64, radians
        Azimuth of the panel's centre line.
    half : (m,) float64, radians
        Half the angular width of the panel.
    low, high : (m,) float64
        Tangent of the elevation of its lower and upper edge.
    reflected : (m,) float64
        Reflectivity times cosine of incidence; see `Panel`.
    """

    distance: Float
    azimuth: Float
    half: Float
    low: Float
    high: Float
    reflected: Float

    @classmethod
    def seen_from(cls, origin: Float, users: RoadUsers) -> PanelRows:
        """Return the panels of road users as seen from a sensor at ``origin`` (3,)."""
        panels = [PANELS[name] for name in BODIES]
        width, height, reflected = (
            np.array([getattr(panel, name) for panel in panels])[users.body]
            for name in ("width", "height", "reflected")
        )
        x, y, z = (users.xyz - origin).T
        distance = np.maximum(np.hypot(x, y), width / 2)
        half = np.arcsin(width / (2 * distance))
        return cls(distance, np.arctan2(y, x), half, z / distance, (z + height) / distance, reflected)


def expected_returns(
    caster: RayCaster, origin: Float, orientation: Float, model: LidarModel, users: RoadUsers
) -> tuple[Float, int]:
    """Compute the expected returns of a sensor from each road user.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the static scene.
    origin : (3,) float64, metres
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.

    Returns
    -------
    returns : (m,) float64
    cast : int
        Number of rays.
    """
    if is_upright(orientation):
        return upright_returns(caster, origin, yaw_of(orientation), model, users)
    return _all_ray_returns(caster, origin, orientation, model, users)


def upright_returns(
    caster: RayCaster, origin: Float, yaw: float, model: LidarModel, users: RoadUsers
) -> tuple[Float, int]:
    """Compute the expected returns of an upright sensor from each road user.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the static scene.
    origin : (3,) float64, metres
    yaw : float, radians
        Direction of azimuth zero.

    Returns
    -------
    returns : (m,) float64
    cast : int
        Number of rays.
    """
    panels, steps = PanelRows.seen_from(origin, users), model.azimuth_count
    unit = np.ones(len(users))
    item, channel = channels_between(model, panels.low, panels.high, unit, unit)
    level = np.cos(model.elevations)
    ranged = panels.distance[item] / level[channel]
    within = (ranged >= model.min_range) & (ranged <= model.max_range)
    item, channel, ranged = item[within], channel[within], ranged[within]
    ahead = panels.azimuth[item] - (yaw + model.azimuth_offsets + model.first_azimuth)[channel]
    row, first, count = steps_in_arcs(ahead, panels.half[item], model.azimuth_step, steps, all_round=model.all_round)
    if not len(row):
        return np.zeros(len(users)), 0
    item, channel, ranged = item[row], channel[row], ranged[row]
    ray = np.repeat(channel * steps, count) + concatenated_ranges(first, count) % steps
    met = np.zeros(model.channels * steps, dtype=bool)
    met[ray] = True
    cast = np.flatnonzero(met)
    free = np.zeros(len(met))
    distance, _ = caster.cast(origin, BeamPattern(model, yaw).directions(cast), model.max_range)
    free[cast] = distance * level[cast // steps]
    reaches = free[ray] >= np.repeat(panels.distance[item], count)
    number = np.add.reduceat(reaches, np.cumsum(count) - count, dtype=np.int64)
    chance = model.law.chance(ranged, panels.reflected[item] * level[channel])
    return _summed(item, chance * number, users), len(cast)


def _all_ray_returns(
    caster: RayCaster, origin: Float, orientation: Float, model: LidarModel, users: RoadUsers
) -> tuple[Float, int]:
    """Compute the expected returns of a sensor of any orientation; see `expected_returns`."""
    panels = PanelRows.seen_from(origin, users)
    directions = BeamPattern(model).directions(np.arange(model.channels * model.azimuth_count)) @ orientation.T
    level = np.hypot(directions[:, 0], directions[:, 1])
    with np.errstate(divide="ignore"):
        rise = directions[:, 2] / level
    useful = np.flatnonzero((rise >= panels.low.min()) & (rise <= panels.high.max()))
    azimuth = np.arctan2(directions[useful, 1], directions[useful, 0])
    order = np.argsort(azimuth, kind="stable")
    useful, azimuth = useful[order], azimuth[order]
    item, ray = _rays_on(panels, azimuth, rise[useful])
    met, place = np.unique(ray, return_inverse=True)
    used = useful[met]
    distance = caster.cast(origin, directions[used], model.max_range)[0] * level[used]
    ranged = panels.distance[item] / level[used][place]
    detected = (distance[place] >= panels.distance[item]) & (ranged >= model.min_range) & (ranged <= model.max_range)
    item, place, ranged = item[detected], place[detected], ranged[detected]
    chance = model.law.chance(ranged, panels.reflected[item] * level[used][place])
    return _summed(item, chance, users), len(used)


def _summed(item: Integer, chance: Float, users: RoadUsers) -> Float:
    return np.bincount(item, chance, minlength=len(users)).astype(np.float64)


def _rays_on(panels: PanelRows, azimuth: Float, rise: Float) -> tuple[Integer, Integer]:
    """Return all pairs of a panel and a ray that meets it, (k,) int64 each.

    Parameters
    ----------
    azimuth : (n,) float64, radians
        Azimuths of the rays, ascending, from -π to π.
    rise : (n,) float64
        Tangents of their elevations.
    """
    # Panels near ±π need rays of both ends: three copies of the azimuths, a turn apart, make every panel one slice.
    around = np.concatenate([azimuth - math.tau, azimuth, azimuth + math.tau])
    first = np.searchsorted(around, panels.azimuth - panels.half, "left")
    count = np.searchsorted(around, panels.azimuth + panels.half, "right") - first
    found = []
    for part in np.array_split(np.arange(len(first)), max(1, math.ceil(count.sum() / _PAIRS_AT_ONCE))):
        item = np.repeat(part, count[part])
        ray = concatenated_ranges(first[part], count[part]) % len(azimuth)
        on = (rise[ray] >= panels.low[item]) & (rise[ray] <= panels.high[item])
        found.append((item[on], ray[on]))
    items, rays = zip(*found, strict=True)
    return np.concatenate(items), np.concatenate(rays)
