"""Map on which a junction is picked: what the mouse does with it, and where it is drawn."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_places import site_places
from seip_addon.panel.junction_map import StreetMap
from seip_addon.panel.session import session
from tests.builders.osm_text import Extract, crossing

SCENES = Path(__file__).resolve().parents[2] / "scenes"
FRAME = (60.0, 0.0, 860.0, 600.0)


def grid(side=12, spacing=40):
    """Streets on a grid, every fourth of them a main one."""
    extract = Extract()
    for number in range(side):
        at, kind = number * spacing, "primary" if number % 4 == 0 else "residential"
        line = [(other * spacing, at) for other in range(side)]
        extract.way(line, highway=kind, name=f"Row {number}")
        extract.way([(y, x) for x, y in line], highway=kind, name=f"Column {number}")
    return extract


@pytest.fixture(params=["extract", "map"])
def places(request, add_on, tmp_path):
    opendrive = SCENES / "corridor.xodr"
    return finish(site_places(grid().write(tmp_path / "grid.osm") if request.param == "extract" else opendrive))


@pytest.fixture
def street_map(places):
    return StreetMap(places, FRAME, 1.0)


def event(kind, value="PRESS"):
    return SimpleNamespace(type=kind, value=value)


def pixel(street_map, junction):
    return tuple(street_map.view.to_pixels(street_map.plan.junctions)[junction].tolist())


def test_a_click_picks_the_junction_under_the_mouse(street_map):
    for junction in street_map.shown().tolist():
        x, y = pixel(street_map, junction)
        for kind, value in (("MOUSEMOVE", "NOTHING"), ("LEFTMOUSE", "PRESS")):
            assert street_map.handle(event(kind, value), (x + 2, y - 1)) == ""
        assert street_map.handle(event("LEFTMOUSE", "RELEASE"), (x + 3, y - 1)) == "PICK"
        assert street_map.hovered == junction


def test_another_file_forgets_the_choice_and_the_same_one_keeps_it(add_on, tmp_path):
    scene = bpy.context.scene
    path = grid(4).write(tmp_path / "grid.osm")
    bpy.ops.seip.choose_map(filepath=str(path))
    assert session.places.places
    site = scene.seip.site
    site.junction, site.radius = site.junctions[3].name, 55.0
    bpy.ops.seip.choose_map(filepath=str(path))
    assert (site.junction, site.radius) == (site.junctions[3].name, 55.0)
    bpy.ops.seip.choose_map(filepath=str(crossing().write(tmp_path / "other.osm")))
    assert (site.junction, site.radius) == ("", 80.0)
    assert [one.name for one in site.junctions] == [one.name for one in session.places.places]
