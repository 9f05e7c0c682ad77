"""Ray culling: the rays of a list with arbitrary directions that can return from near a target.

Returns within δ of a target lie in its patch (`beam_culling`), which spans a range of azimuths and one of elevations as
seen from the sensor. Both are divided into cells; a ray in a cell that no patch reaches cannot return from a patch.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Float, Integer
from .beam_culling import Patches

_AZIMUTHS, _ELEVATIONS = 720, 360  # cells of half a degree: about as far apart as rays are
_MARGIN = 1e-6  # part of a cell


def rays_near(patches: Patches, azimuth: Float, elevation: Float, max_range: float) -> Integer:
    """Find the rays that can return from patches.

    Parameters
    ----------
    patches : Patches
        Patches as seen from the sensor.
    azimuth, elevation : (n,) float64, radians
        Directions of the rays.
    max_range : float, metres
        Range of the sensor.

    Returns
    -------
    (k,) int64
        Numbers of the rays, ascending: all that can return from a patch, and few that cannot.
    """
    # Elevations of a patch: a lower edge below the sensor is steepest at the near side of the cylinder, one above it
    # flattest at the far side; likewise for the upper edge. Azimuths: the tangents to the cylinder, or all around from
    # within it.
    near = np.maximum(patches.distance - patches.radius, 0.0)
    some = (patches.bottom <= patches.top) & (near <= max_range)
    near, far = near[some], (patches.distance + patches.radius)[some]
    bottom, top = patches.bottom[some], patches.top[some]
    lowest = np.arctan2(bottom, np.where(bottom < 0, near, far))
    highest = np.arctan2(top, np.where(top > 0, near, far))
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.arcsin(np.minimum(patches.radius / patches.distance, 1.0))[some]  # 0 / 0 is replaced below
    half = np.where(near > 0, half, math.pi)

    # Each patch adds 1 to all cells of its rectangle. With +1 and -1 at the rectangle's four corners (a difference
    # array), running sums along both axes give the number of rectangles over each cell, whatever their size. Azimuths
    # take two turns, so that rectangles across azimuth zero stay whole; both turns are added up at the end.
    first_row, end_row = _elevation_rows(lowest, -_MARGIN), _elevation_rows(highest, _MARGIN) + 1
    first = np.floor(_azimuth_cells(patches.azimuth[some] - half) - _MARGIN).astype(np.int64)
    end = np.floor(_azimuth_cells(patches.azimuth[some] + half) + _MARGIN).astype(np.int64) + 1
    end = np.minimum(end, first + _AZIMUTHS)
    shift = first // _AZIMUTHS * _AZIMUTHS
    first, end = first - shift, end - shift
    reached = np.zeros((_ELEVATIONS + 1, 2 * _AZIMUTHS + 1), dtype=np.int64)
    for row, sign in ((first_row, 1), (end_row, -1)):
        np.add.at(reached, (row, first), sign)
        np.add.at(reached, (row, end), -sign)
    reached = reached.cumsum(axis=0).cumsum(axis=1)
    both = reached[:, :_AZIMUTHS] + reached[:, _AZIMUTHS : 2 * _AZIMUTHS]
    column = np.floor(_azimuth_cells(azimuth)).astype(np.int64) % _AZIMUTHS
    return np.flatnonzero(both[_elevation_rows(elevation, 0.0), column] > 0)


def _azimuth_cells(azimuth: Float) -> Float:
    """Return azimuths in cells."""
    cells: Float = azimuth * (_AZIMUTHS / math.tau)
    return cells


def _elevation_rows(elevation: Float, margin: float) -> Integer:
    """Return the rows of cells that elevations lie in."""
    row = np.floor((elevation / math.pi + 0.5) * _ELEVATIONS + margin)
    rows: Integer = np.clip(row, 0, _ELEVATIONS - 1).astype(np.int64)
    return rows
