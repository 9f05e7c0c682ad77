"""Plan of a map: its dots lie on its junctions, and its lines are its roads."""

from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_places import site_places
from seip_addon.core.world.opendrive.junctions import junction_area
from seip_addon.core.world.opendrive.lanes import lane_surfaces
from seip_addon.core.world.opendrive.read import read_map

SCENES = Path(__file__).resolve().parents[4] / "scenes"


@pytest.mark.parametrize("name", ["junction", "corridor"])
def test_dots_lie_on_the_junctions_and_lines_on_the_carriageway(name):
    places = finish(site_places(SCENES / f"{name}.xodr"))
    road_map = read_map(SCENES / f"{name}.xodr")
    lanes = [lane for road in road_map.roads for lane in lane_surfaces(road)]
    areas = [junction_area(lanes, place.key) for place in places.places]
    shift = road_map.roads[0].frame(np.zeros(1)).origin[0, :2] - places.plan.streets[0].line[0]
    for area, (x, y) in zip(areas, places.plan.junctions + shift, strict=True):
        assert area.contains(shapely.Point(x, y))
    road = shapely.union_all([lane.polygon for lane in lanes]).buffer(1.0)
    assert len(places.plan.streets) == len(road_map.roads)
    assert all(road.covers(shapely.LineString(street.line + shift)) for street in places.plan.streets)
    assert set(places.plan.names.names) == {road.name for road in road_map.roads if road.name and not road.junction_id}
    assert not any(f"junction{place.key}" in place.name.casefold() for place in places.places)
