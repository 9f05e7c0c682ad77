"""A straight street with one pavement, and settings of candidates on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry

PLAIN = CandidateSettings(sensors=("type1",), heights=(3.5, 8.0), spacing=4.0)


def sheet(low_x, low_y, high_x, high_y, z=0.0):
    a, b, c, d = ((low_x, low_y, z), (high_x, low_y, z), (high_x, high_y, z), (low_x, high_y, z))
    return np.array([[a, b, c], [a, c, d]], dtype=float)


def block(low, high):
    """Twelve triangles of a closed box, outward normals."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    p = np.array([(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([p[list(t)] for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def street(**changes):
    """A road along x with a 3 m pavement, 0.1 m high, on its north side."""
    geometry = SceneGeometry(
        name="street",
        origin=np.zeros(3),
        roads=(Mesh("road", sheet(-40, -7, 40, 7)),),
        ground=(Mesh("pavement", sheet(-40, 7, 40, 10, 0.1)),),
        occluders=(),
        region=shapely.box(-30, -7, 30, 7),
        candidate_areas=shapely.box(-40, 7, 40, 10),
    )
    return replace(geometry, **changes)
