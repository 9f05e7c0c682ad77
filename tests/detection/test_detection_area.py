"""Where a detector looks: the foreground, with heights above the road."""

from dataclasses import replace

from headless.detection.detection_area import area_of

import numpy as np
import pytest
import shapely

from seip_addon.core.errors import SeipError
from tests.builders.sloping_road import hill
from tests.builders.street_clouds import cloud_frame, street_frame


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


def test_the_background_is_left_out():
    area = area_of(hill(0.0, 0.0, 0.0), 0.4)
    frame = street_frame(3)
    assert 0 < len(area.cloud(frame)) <= np.count_nonzero(frame.instance >= 0)
    assert len(area.cloud(replace(frame, foreground=np.zeros(len(frame), dtype=np.bool_)))) == 0


def test_a_site_without_road_or_region_is_refused():
    with pytest.raises(SeipError, match="no road in the region of interest"):
        area_of(replace(hill(), roads=()), 0.4)
    with pytest.raises(SeipError, match="region of interest with an area"):
        area_of(replace(hill(), region=shapely.box(3, 0, 3, 0)), 0.4)
