"""Real maps: all load, one has known figures, and another reader finds the same areas."""

import functools
import os
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.world.opendrive.read import read_map
from tests.builders.opendrive_text import map_lanes
from tests.few import few

FOLDER = Path(os.environ.get("SEIP_MAPS") or Path(__file__).resolve().parents[5] / "shared" / "opendrive")
NAMES = ["Town01", "Town05", "crest-curve", "parking_demo", "stationary_objects"]


@functools.cache
def loaded(name):
    """A map and all its lanes; nobody changes them."""
    road_map = read_map(map_file(name))
    return road_map, map_lanes(road_map)


def map_file(name):
    path = FOLDER / f"{name}.xodr"
    if not path.exists():
        pytest.skip(f"no map at {path}; set SEIP_MAPS to the folder that holds it")
    return path


@pytest.mark.parametrize("name", few(NAMES, 1))
def test_a_real_map_has_sound_surfaces_objects_and_signals(name):
    road_map, surfaces = loaded(name)
    assert surfaces
    for surface in surfaces:
        normals = np.cross(*np.diff(surface.triangles, axis=1).swapaxes(0, 1))
        assert (normals[:, 2] >= 0).all()
        assert surface.polygon.is_valid
    for placed in road_map.objects:
        assert np.isfinite(placed.position).all()
        assert all(len(outline.base) == len(outline.height) >= 2 for outline in placed.outlines)
    assert all(np.isfinite(signal.position).all() for signal in road_map.signals)


def areas(named_polygons):
    """Return summed and united area by lane type."""
    by_type = defaultdict(list)
    for kind, polygon in named_polygons:
        by_type[kind].append(polygon)
    return {
        kind: (sum(polygon.area for polygon in polygons), shapely.union_all(polygons).area)
        for kind, polygons in by_type.items()
    }


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # the other reader's warnings are its own
@pytest.mark.parametrize("name", ["Town01", "Town05"])
def test_another_reader_finds_the_same_areas(name):
    network = pytest.importorskip(
        "pyxodr_omega_prime.road_objects.network", reason="cross-check needs pyxodr-omega-prime==0.1.5"
    )
    path = map_file(name)
    # It samples each lane section at steps of its resolution and loses what is left at the end, hence the fine one.
    lanes = (
        (
            lane.type,
            shapely.make_valid(shapely.Polygon(np.vstack([lane.boundary_line, lane.lane_reference_line[::-1]]))),
        )
        for road in network.RoadNetwork(str(path), resolution=0.02).get_roads()
        for section in road.lane_sections
        for lane in section.lanes
    )
    theirs = areas((kind, shapely.force_2d(polygon)) for kind, polygon in lanes)
    ours = areas((surface.lane_type, surface.polygon) for surface in map_lanes(read_map(path)))
    for kind in ("driving", "sidewalk", "shoulder"):
        assert ours[kind] == pytest.approx(theirs[kind], rel=1e-3), kind


def test_the_figures_of_town05():
    road_map, surfaces = loaded("Town05")
    assert len(road_map.roads) == 259
    assert sum(road.junction_id is not None for road in road_map.roads) == 206
    assert len(road_map.junctions) == 21
    assert sum(road.length for road in road_map.roads) == pytest.approx(8.0e3, rel=5e-3)
    records = Counter(
        lane.type for road in road_map.roads for section in road.sections for lane in (*section.left, *section.right)
    )
    assert {kind: records[kind] for kind in ("driving", "sidewalk", "shoulder", "parking")} == {
        "driving": 1658,
        "sidewalk": 117,
        "shoulder": 200,
        "parking": 18,
    }
    found = areas((surface.lane_type, surface.polygon) for surface in surfaces)
    assert found["driving"] == pytest.approx((82_184, 71_979), rel=5e-3)
    assert found["sidewalk"][1] == pytest.approx(26_443, rel=5e-3)
