"""Surface of a road on which road users stand."""

import numpy as np
import shapely

from ...base.arrays import Float, Integer
from ...geometry.plan import MIN_AREA, heights_over, plane_height, signed_area

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
