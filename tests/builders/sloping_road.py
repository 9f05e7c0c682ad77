"""Scene of a square road on a slope."""

import numpy as np
import shapely

from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry


def hill(slope=0.06, across=0.02, base=100.0, half=24.0):
    """A square road that rises to the east and a little to the north."""
    corners = np.array([[x, y, base + slope * x + across * y] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    corners[:, :2] *= half
    corners[:, 2] = base + slope * corners[:, 0] + across * corners[:, 1]
    road = Mesh("road", corners[[[0, 1, 2], [0, 2, 3]]])
    return SceneGeometry("Hill", np.zeros(3), (road,), (), (), shapely.box(-16, -16, 16, 16))
