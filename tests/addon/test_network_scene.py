"""Whole extract as a scene: junctions to select, sites in scenes of their own, and the way back."""

from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from mathutils import Color

from seip_addon.core.output.pictures.palette import NO_SITE_COLOUR, SHARE_COLOURS, rgb
from seip_addon.core.progress import finish
from seip_addon.core.workflows.site_places import site_places
from seip_addon.operators.site import has_site
from seip_addon.panels.steps import SEIP_PT_steps
from seip_addon.scene import contract
from seip_addon.scene.network import is_network, junctions
from tests.builders.osm_text import Extract, crossing
from tests.sumo_here import needs_sumo

TOWN = Path(__file__).resolve().parents[2] / "scenes" / "town.osm"


@pytest.fixture
def town(add_on):
    """The scene of the invented town."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert bpy.ops.seip.import_network(filepath=str(TOWN)) == {"FINISHED"}
    return bpy.context.scene


def select(obj):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def has_colour(obj, colour):
    """Return whether an object is drawn in a web colour."""
    shown = Color(obj.color[:3]).from_scene_linear_to_srgb()
    return np.allclose(shown, rgb(colour), atol=2e-3)


def drawn():
    """Return the texts and operators that the panel draws."""
    layout = MagicMock()
    for part in ("row", "column", "box", "split"):
        getattr(layout, part).return_value = layout
    layout.panel_prop.return_value = layout.panel.return_value = (layout, None)
    SEIP_PT_steps.draw(SimpleNamespace(layout=layout), bpy.context)
    texts = "\n".join(call.kwargs["text"] for call in layout.label.call_args_list)
    return texts, [call.args[0] for call in layout.operator.call_args_list]


def test_all_junctions_lie_where_the_extract_has_them(town):
    assert is_network(town)
    assert town.name == "town"
    assert not {"Cube", "Light", "Camera"} & set(town.objects.keys())
    places = finish(site_places(TOWN))
    found = junctions(town)
    assert [obj[contract.JUNCTION] for obj in found] == [place.name for place in places.places]
    at = np.array([obj.location[:2] for obj in found])
    assert np.allclose(at, places.plan.junctions, atol=1e-3)
    streets = [obj for obj in town.objects if contract.JUNCTION not in obj]
    assert streets
    assert all(obj.hide_select for obj in streets)
    assert sum(len(obj.data.polygons) for obj in streets) == sum(len(one.line) - 1 for one in places.plan.streets)
    assert all(has_colour(obj, NO_SITE_COLOUR) for obj in found)


def test_all_views_see_all_junctions_from_above(town):
    views = [area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"]
    assert views
    at = np.array([obj.location[:2] for obj in junctions(town)])
    for area in views:
        space = area.spaces.active
        look = space.region_3d
        assert look.view_perspective == "ORTHO"
        assert np.allclose(look.view_location[:2], (at.min(axis=0) + at.max(axis=0)) / 2, atol=0.1)
        assert space.clip_end > look.view_distance
        assert space.shading.color_type == "OBJECT"


def test_the_panel_asks_for_a_junction_and_names_the_selected_one(town):
    bpy.context.view_layer.objects.active = None
    texts, operators = drawn()
    assert "Click a junction in the view" in texts
    assert operators == ["seip.open_junction"]
    with pytest.raises(RuntimeError, match="Click a junction first"):
        bpy.ops.seip.open_junction()
    select(junctions(town)[3])
    texts, _ = drawn()
    assert junctions(town)[3].name in texts
    assert "It has no site yet" in texts


@needs_sumo
def test_a_junction_is_opened_in_a_scene_of_its_own_and_found_again(town):
    first, second = junctions(town)[:2]
    town.seip.site.radius = 30.0
    select(first)
    assert bpy.ops.seip.open_junction() == {"FINISHED"}
    site = bpy.context.scene
    assert site != town
    assert has_site(site)
    assert site.seip.site.junction == first[contract.JUNCTION]
    assert site.seip.site.radius == pytest.approx(30.0)
    assert not is_network(site)
    assert "seip.show_network" in drawn()[1]
    assert bpy.ops.seip.show_network() == {"FINISHED"}
    assert bpy.context.scene == town
    assert has_colour(first, SHARE_COLOURS[0])
    assert has_colour(second, NO_SITE_COLOUR)
    number = len(bpy.data.scenes)
    select(first)
    bpy.ops.seip.open_junction()
    assert bpy.context.scene == site
    assert len(bpy.data.scenes) == number
    bpy.ops.seip.show_network()
    select(second)
    bpy.ops.seip.open_junction()
    assert bpy.context.scene not in {town, site}
    assert has_site(site)


@needs_sumo
def test_a_site_that_is_there_is_opened_again_as_a_site_is_shown(town):
    one = junctions(town)[0]
    town.seip.site.radius = 30.0
    select(one)
    bpy.ops.seip.open_junction()
    site = bpy.context.scene
    spaces = [area.spaces.active for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"]
    looks = [(space.region_3d.view_location.copy(), space.region_3d.view_distance) for space in spaces]
    site.seip.site.junction = junctions(town)[1][contract.JUNCTION]  # chosen, and not built
    bpy.ops.seip.show_network()
    select(one)
    bpy.ops.seip.open_junction()
    assert bpy.context.scene == site
    assert len(bpy.data.scenes) == 2
    for space, (location, distance) in zip(spaces, looks, strict=True):
        assert space.shading.color_type == "MATERIAL"
        assert space.region_3d.view_perspective == "PERSP"
        assert np.allclose(space.region_3d.view_location, location, atol=1e-3)
        assert space.region_3d.view_distance == pytest.approx(distance, rel=1e-4)


@needs_sumo
def test_a_site_that_cannot_be_built_leaves_no_scene(town):
    one = junctions(town)[0]
    select(one)
    town.seip.site.buildings = str(TOWN.parent / "missing.json")
    with pytest.raises(RuntimeError, match=r"missing\.json"):
        bpy.ops.seip.open_junction()
    assert [scene.name for scene in bpy.data.scenes] == [town.name]
    assert bpy.context.scene == town


def test_no_site_is_built_on_the_network_and_its_extract_stays(town):
    bpy.ops.seip.load_example()
    assert bpy.context.scene != town
    assert not has_site(town)
    assert bpy.context.scene.seip.site.network is None
    bpy.context.window.scene = town
    with pytest.raises(RuntimeError, match="This scene shows a network"):
        bpy.ops.seip.choose_map(filepath=str(TOWN.parent / "junction.xodr"))
    assert town.seip.site.source == str(TOWN)


def test_junctions_keep_their_names_beside_objects_of_the_same_name(add_on):
    names = [place.name for place in finish(site_places(TOWN)).places]
    for name in names:
        bpy.data.objects.new(name, None)
    bpy.ops.seip.import_network(filepath=str(TOWN))
    select(junctions(bpy.context.scene)[0])
    assert names[0] in drawn()[0].splitlines()


def test_work_that_is_in_the_scene_stays(add_on, tmp_path):
    before = bpy.context.scene
    before.collection.objects.link(bpy.data.objects.new("mine", None))
    bpy.ops.seip.import_network(filepath=str(crossing().write(tmp_path / "place.osm")))
    assert bpy.context.scene != before
    assert [obj.name for obj in before.objects] == ["mine"]
    assert len(junctions(bpy.context.scene)) == 1


def test_a_site_without_a_network_has_no_way_back(add_on):
    with pytest.raises(RuntimeError, match="not of a network"):
        bpy.ops.seip.show_network()
    assert "seip.show_network" not in drawn()[1]


@pytest.mark.parametrize(
    ("name", "message"),
    [("place.xodr", "is not an extract of OpenStreetMap"), ("empty.osm", "no crossing of named streets")],
)
def test_a_file_without_junctions_to_show_is_refused(add_on, tmp_path, name, message):
    path = tmp_path / name
    if name.endswith(".osm"):
        one_way = Extract()
        one_way.way([(0, 0), (100, 0)], highway="residential", name="Alone")
        one_way.write(path)
    else:
        path.write_bytes((TOWN.parent / "junction.xodr").read_bytes())
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.seip.import_network(filepath=str(path))
    assert not is_network(bpy.context.scene)
    assert len(bpy.data.scenes) == 1
