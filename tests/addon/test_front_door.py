"""Where people look for the add-on: the File menu, files dropped into a view, and the menus that the search goes by."""

import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


from seip_addon.panel import coverage, detection, events, export, results, scene_status, sidebar
from seip_addon.panel import layout as layout_parts
from seip_addon.panel.work import LongWork
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import placed_sensors
from seip_addon.scene.views import CLIP_END
from seip_addon.scene.write import write_result
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import make_example

SCENES = Path(__file__).resolve().parents[2] / "scenes"


@pytest.fixture
def fresh(add_on):
    """Blender as it starts, with cube, light and camera."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def views():
    return [a.spaces.active for a in bpy.context.window.screen.areas if a.type == "VIEW_3D"]


def drawn(draw):
    """Return the texts and operators that a menu draws."""
    layout = MagicMock()
    draw(SimpleNamespace(layout=layout), bpy.context)
    return [call.args[0] for call in layout.operator.call_args_list]


def test_import_is_in_the_file_menu_and_takes_dropped_files(scene):
    assert drawn(sidebar.draw_import) == ["seip.choose_map", "seip.choose_map"]
    handler = bpy.types.SEIP_FH_map
    assert (handler.bl_import_operator, handler.bl_file_extensions) == ("seip.choose_map", ".xodr;.osm;.gz")
    for kind, expected in (("VIEW_3D", True), ("TEXT_EDITOR", False)):
        area = SimpleNamespace(area=SimpleNamespace(type=kind))
        assert handler.poll_drop(area) == expected


def test_the_example_is_the_shipped_junction_without_the_start_up_cube_and_the_view_shows_it_all(fresh):
    assert bpy.ops.seip.load_example() == {"FINISHED"}
    assert bpy.context.scene == fresh
    assert not {"Cube", "Light", "Camera"} & set(fresh.objects.keys())
    assert views()
    middle = np.mean([obj.location[:2] for obj in contract.find(fresh, contract.POLES).objects], axis=0)
    for space in views():
        assert space.clip_end == CLIP_END
        assert space.shading.color_type == "MATERIAL"
        assert space.region_3d.view_perspective == "PERSP"
        assert np.hypot(*(np.array(space.region_3d.view_location[:2]) - middle)) < 60
        assert 50 < space.region_3d.view_distance < 1000
    assert scene_status.next_step(fresh) == "seip.check_site"
    built = read_scene(fresh).geometry
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / "junction.blend"))
    shipped = read_scene(bpy.context.scene).geometry
    assert built.region.area == pytest.approx(shipped.region.area)
    assert len(built.occluders) == len(shipped.occluders)


def test_the_next_step_leads_to_placed_sensors(junction):
    assert scene_status.next_step(junction) == "seip.check_site"
    bpy.ops.seip.check_site()
    assert scene_status.next_step(junction) == "seip.solve_placement"
    for one in junction.seip.survey.types:
        one.use = False
    assert scene_status.next_step(junction) == "seip.choose_sensors"
    junction.seip.survey.types["type1"].use = True
    bpy.ops.seip.solve_placement()
    assert scene_status.next_step(junction) == ""


@pytest.mark.parametrize("copied", [False, True])
def test_the_post_of_a_deleted_sensor_goes_with_it(scene, copied):
    example = make_example()
    scene = make_scene(example.geometry)
    write_result(scene, example.site, example.deployment)
    sensor = placed_sensors(scene)["S1"]
    before = {obj.name for obj in scene.objects}
    if copied:  # with its body, as Shift+D copies what is selected
        bpy.context.view_layer.update()
        with bpy.context.temp_override(selected_objects=[sensor, *sensor.children]):
            bpy.ops.object.duplicate()
        bpy.context.view_layer.update()
        (sensor,) = (obj for obj in scene.objects if obj.name not in before and obj.type == "EMPTY")
        events.remove_loose_pieces()
    else:
        before -= {sensor.name, *(child.name for child in sensor.children)}
    assert len(sensor.children) == 1
    with bpy.context.temp_override(selected_objects=[sensor]):
        bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert bpy.app.timers.is_registered(events.remove_loose_pieces)
    events.remove_loose_pieces()
    assert {obj.name for obj in scene.objects} == before


def test_a_section_has_one_sentence_where_there_is_nothing_yet(scene, monkeypatch):
    for draw in (results.draw, export.draw, coverage.draw_view, detection.draw):
        said = []
        for module in (layout_parts, coverage, detection):
            monkeypatch.setattr(module, "draw_sentence", lambda _, text, said=said, **__: said.append(text))
        layout = DrawnLayout()
        draw(layout, bpy.context)
        assert len(said) == 1
        assert not layout.operators


def headers(monkeypatch, width, status, *, running):
    """Return what the closed header of the placement shows in a sidebar of a width: texts and icons."""
    monkeypatch.setattr(layout_parts, "session", SimpleNamespace(running=running and SimpleNamespace(operator=running)))
    region = SimpleNamespace(width=width)
    context = SimpleNamespace(region=region, **{n: getattr(bpy.context, n) for n in ("window_manager", "preferences")})
    monkeypatch.setattr(layout_parts, "bpy", SimpleNamespace(context=context))
    bpy.context.window_manager.seip_sections.placement = False
    layout = DrawnLayout()
    layout_parts.draw_sections(layout, {"placement": None}, None, {"placement": status})
    return layout.labels[1:]


def test_a_closed_header_shows_change_and_work_at_every_width_and_no_result_is_cut(scene, monkeypatch):
    long = layout_parts.Status(changed=True, result=("94%", "$48k", "within 12.3%"))
    work = "seip.solve_placement"
    assert headers(monkeypatch, 500, long, running=work) == [("changed · working · 94% · $48k · within 12.3%", "NONE")]
    assert headers(monkeypatch, 320, long, running=work) == [("changed · working · 94%", "NONE")]
    assert headers(monkeypatch, 500, long, running="seip.detect")[0][0].startswith("changed · 94%")
    for width in range(120, 280, 10):
        shown = headers(monkeypatch, width, long, running=work)
        assert shown in ([("changed · working", "NONE")], [("", "ERROR"), ("", "TIME")])
        free = layout_parts.Status(result=("no room for a result as long as this one", "3"))
        assert headers(monkeypatch, width, free, running=None) in ([], [("3", "NONE")])


def test_the_header_of_some_section_shows_the_work_of_each_operator(scene):
    def kinds(kind):
        return {one for below in kind.__subclasses__() for one in (below, *kinds(below))}

    long = {kind.bl_idname.partition(".")[2] for kind in kinds(LongWork) if hasattr(kind, "bl_idname")}
    assert set().union(*layout_parts.WORK.values()) == long


@pytest.mark.parametrize("width", [90.0, 160.0, 420.0])
def test_no_line_is_wider_than_its_room_and_no_letter_of_a_path_is_lost(scene, width, monkeypatch):
    text = "written to /srv/somebody/a/very/long/path_that_has_no_blank/and-goes-on/result/placement.json at once"
    monkeypatch.setattr(layout_parts, "sidebar_width", lambda: width)
    lines = layout_parts.wrapped(text, 30.0)
    assert max(map(layout_parts.text_width, lines)) <= width - 30.0
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_all_sections_open_without_and_with_a_placement(junction, monkeypatch):
    for name in [one.identifier for one in bpy.context.window_manager.seip_sections.bl_rna.properties]:
        if name not in {"rna_type", "name"}:
            setattr(bpy.context.window_manager.seip_sections, name, True)
    monkeypatch.setattr(coverage, "shows_coverage", lambda _: True)  # there is no 3D view
    panel = SimpleNamespace(layout=DrawnLayout())
    bpy.types.SEIP_PT_steps.draw(panel, bpy.context)
    bpy.ops.seip.solve_placement()
    bpy.ops.seip.keep_placement(name="kept")
    for name in ("site", "sensors", "placement"):
        setattr(bpy.context.window_manager.seip_sections, name, True)
    panel.layout = DrawnLayout()
    bpy.types.SEIP_PT_steps.draw(panel, bpy.context)
    drawn = {name for name, _ in panel.layout.operators}
    assert {"seip.check_site", "seip.choose_sensors", "seip.solve_placement"} <= drawn
    assert {"seip.export_result", "seip.show_comparison"} <= drawn
    menu = {f"seip.{name}" for step in sidebar.STEPS for name in step}
    own = {name.partition(".")[2] for name in drawn | menu if name.startswith("seip.")}
    assert all(hasattr(bpy.types, f"SEIP_OT_{name}") for name in own)
