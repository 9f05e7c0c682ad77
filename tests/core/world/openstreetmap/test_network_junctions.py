"""Junctions of an extract that a rule selects, and the writing of a part of it."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.tangent_plane import plan_metres
from seip_addon.core.workflows.network_sites import extract_xml
from seip_addon.core.world.openstreetmap.crossings import SAME_JUNCTION, selected_junctions
from seip_addon.core.world.openstreetmap.extract import cropped, read_extract, window
from tests.builders.osm_text import Extract


@pytest.fixture
def town(tmp_path):
    """Three streets in a row, 300 m apart, across one main street; signals at the first, and a divided fourth one."""
    extract = Extract()
    main = [(x, 0.0) for x in (-200.0, 0.0, 300.0, 600.0, 900.0, 918.0, 1100.0)]
    extract.way(main, highway="secondary", name="Main Street")
    extract.way([(0.0, -150.0), (0.0, 0.0), (0.0, 150.0)], highway="residential", name="First Lane")
    extract.way([(300.0, -150.0), (300.0, 0.0), (300.0, 150.0)], highway="tertiary", name="Second Lane")
    extract.way([(600.0, 0.0), (600.0, 150.0)], highway="residential", name="Third Lane")
    extract.way([(900.0, -150.0), (900.0, 0.0), (900.0, 150.0)], highway="primary", name="Fourth Road", oneway="yes")
    extract.way([(918.0, 150.0), (918.0, 0.0), (918.0, -150.0)], highway="primary", name="Fourth Road", oneway="yes")
    extract.way([(0.0, 150.0), (300.0, 150.0)], highway="residential", name="Back Lane")
    extract.node(0.0, -20.0, highway="traffic_signals")
    return finish(read_extract(extract.write(tmp_path / "town.osm")))


def names(junctions):
    return [one.name for one in junctions]


def test_rules_select_by_signals_and_by_class(town):
    assert names(selected_junctions(town, ["signals"])) == ["First Lane / Main Street"]
    assert names(selected_junctions(town, ["primary"])) == ["Fourth Road / Main Street"]
    assert len(selected_junctions(town, ["all"])) == 6
    assert names(selected_junctions(town, ["primary", "signals"])) == [
        "First Lane / Main Street",
        "Fourth Road / Main Street",
    ]


def test_two_carriageways_are_one_junction(town):
    found = selected_junctions(town, ["all"])
    assert names(found).count("Fourth Road / Main Street") == 1
    plane = plan_metres([(one.latitude, one.longitude) for one in found], (52.5, 13.4))
    apart = np.hypot(*(plane[:, None] - plane[None]).transpose(2, 0, 1))
    assert apart[~np.eye(len(found), dtype=bool)].min() > SAME_JUNCTION


def test_area_leaves_out_what_is_outside(town):
    (first,) = selected_junctions(town, ["signals"])
    area = shapely.Point(first.longitude, first.latitude).buffer(0.0005)
    assert names(selected_junctions(town, ["all"], area)) == ["First Lane / Main Street"]
    with pytest.raises(SeipError, match="no junction in the given area"):
        selected_junctions(town, ["all"], shapely.box(0, 0, 1, 1))


def test_written_part_reads_back_the_same(town, tmp_path):
    part = cropped(town, window(52.5, 13.4, 400.0))
    path = tmp_path / "part.osm"
    path.write_bytes(extract_xml(part))
    again = finish(read_extract(path))
    assert again.nodes.keys() == part.nodes.keys()
    assert again.ways.keys() == part.ways.keys()
    for number, node in part.nodes.items():
        other = again.nodes[number]
        assert (other.latitude, other.longitude, dict(other.tags)) == (node.latitude, node.longitude, dict(node.tags))
    for number, way in part.ways.items():
        assert (again.ways[number].nodes, dict(again.ways[number].tags)) == (way.nodes, dict(way.tags))
    assert again.attribution == part.attribution
    assert extract_xml(again) == path.read_bytes()
