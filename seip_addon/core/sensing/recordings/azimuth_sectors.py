"""Sectors of azimuth, which intervals treat as independent: neighbouring rays meet the same surfaces."""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Float, Integer


def sector_of(directions: Float, sectors: int) -> Integer:
    """Return the sector of each direction (n, 3), (n,) int64 from 0 to ``sectors`` - 1."""
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    sector: Integer = np.floor((azimuth + math.pi) / math.tau * sectors).astype(np.int64) % sectors
    return sector
