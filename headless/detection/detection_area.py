"""Area of a site in which a detector works: foreground returns over pillars, with heights above the road.

Two properties of the site are removed from every cloud, so that a detector trained at one site works at others: the
background, which is known because a roadside sensor does not move (`Frame.foreground`), and the height of the road,
from which heights of points and boxes are measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.height_raster import HeightRaster
from seip_addon.core.geometry.plan import surface_height
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.site.scene_geometry import SceneGeometry, joined

from .pillars import PillarGrid, grid_over
from .settings import BOTTOM, TOP

ROAD_STEP = 1.0  # metres between two known heights of the road
ROAD_BLUR = 2.0  # metres: standard deviation of the Gaussian that continues the road beyond its edges


@dataclass(frozen=True, eq=False)
class DetectionArea:
    """The pillars of a site, and its road.

    Parameters
    ----------
    grid : PillarGrid
        Over the region of interest; its bottom and top are heights above the road.
    road : HeightRaster
        Heights of the highest carriageway, and of what would continue it elsewhere.
    site : str
        Name of the scene, or "".
    """

    grid: PillarGrid
    road: HeightRaster
    site: str = ""

    def cloud(self, frame: Frame) -> NDArray[np.float32]:
        """Return the foreground returns over the grid, (n, 4): x, y, height above the road (metres), intensity."""
        points = frame.points[frame.foreground]
        cloud = np.column_stack((points, frame.intensity[frame.foreground]))
        cloud[:, 2] -= self.road.at(points[:, :2].astype(np.float64)).astype(np.float32)
        inside: NDArray[np.float32] = cloud[self.grid.holds(cloud)]
        return inside

    def levelled(self, boxes: Float) -> Float:
        """Return boxes (k, 7) in site axes with heights above the road under their middles."""
        return self._moved(boxes, -1.0)

    def raised(self, boxes: Float) -> Float:
        """Return boxes (k, 7) with heights above the road in site axes; the inverse of `levelled`."""
        return self._moved(boxes, 1.0)

    def _moved(self, boxes: Float, sign: float) -> Float:
        moved = boxes.copy()
        moved[:, 2] += sign * self.road.at(boxes[:, :2])
        return moved


def area_of(geometry: SceneGeometry, pillar: float) -> DetectionArea:
    """Return the detection area of a scene, its region of interest, for pillars of a given width in metres.

    Raises
    ------
    SeipError
        There is no region, or no road in it.
    """
    west, south, east, north = map(float, geometry.region.bounds)
    grid = grid_over((west, south, east, north), (BOTTOM, TOP), pillar)
    columns, rows = (int(np.ceil(side / ROAD_STEP)) + 1 for side in (grid.east - grid.west, grid.north - grid.south))
    empty = HeightRaster(np.array((grid.west, grid.south)), ROAD_STEP, np.full((rows, columns), np.nan))
    heights = surface_height(empty.places, joined(geometry.roads)).reshape(rows, columns)
    if not np.isfinite(heights).any():
        raise SeipError("there is no road in the region of interest: put the carriageway into SEIP Roads")
    known = HeightRaster(empty.low, ROAD_STEP, heights)
    continued = known.smoothed(ROAD_BLUR).heights
    road = HeightRaster(empty.low, ROAD_STEP, np.where(np.isfinite(heights), heights, continued))
    return DetectionArea(grid, road, geometry.name)
