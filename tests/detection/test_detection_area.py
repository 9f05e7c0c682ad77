"""Where a detector looks: the foreground, with heights above the road."""

from headless.detection.detection_area import area_of

import numpy as np
import shapely

from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry
from tests.builders.street_clouds import cloud_frame


def hill(slope=0.06, across=0.02, base=100.0, half=24.0):
    """A square road that rises to the east and a little to the north."""
    corners = np.array([[x, y, base + slope * x + across * y] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    corners[:, :2] *= half
    corners[:, 2] = base + slope * corners[:, 0] + across * corners[:, 1]
    road = Mesh("road", corners[[[0, 1, 2], [0, 2, 3]]])
    return SceneGeometry("Hill", np.zeros(3), (road,), (), (), shapely.box(-16, -16, 16, 16))


def test_heights_are_those_above_the_road():
    area = area_of(hill(), 0.4)
    random = np.random.default_rng(1)
    xy = random.uniform(-15.9, 15.9, (500, 2))
    above = random.uniform(-0.9, 4.4, 500)
    z = 100 + 0.06 * xy[:, 0] + 0.02 * xy[:, 1] + above
    cloud = area.cloud(cloud_frame(np.column_stack((xy, z, np.full(500, 0.5))).astype(np.float32)))
    np.testing.assert_allclose(cloud[:, 2], above, atol=1e-4)
    np.testing.assert_array_equal(cloud[:, 3], np.float32(0.5))


def test_boxes_come_back_to_where_they_were():
    area = area_of(hill(), 0.4)
    boxes = np.column_stack([np.random.default_rng(2).uniform(-15, 15, (50, 3)), np.ones((50, 4))])
    np.testing.assert_allclose(area.raised(area.levelled(boxes)), boxes, atol=1e-12)
    assert not np.allclose(area.levelled(boxes), boxes)
