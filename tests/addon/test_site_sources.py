"""Further files of a site in the panel: the scene is that of the batch command with the same files."""

from types import SimpleNamespace

from headless import build_scene

import bpy
import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.panels import placement
from seip_addon.scene import contract
from tests.builders.dem_files import origin_at, write_dem
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.opendrive_text import document, geometry, lane, road, section
from tests.builders.osm_text import Extract

X, Y, _ = origin_at(52.5, 13.4)
UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"


@pytest.fixture
def scene(add_on):
    return bpy.context.scene


@pytest.fixture
def street(tmp_path):
    head = f'<header><offset x="{X}" y="{Y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference></header>'
    path = tmp_path / "street.xodr"
    body = road(geometry(length=200.0, x=-100.0), section(lane(1), lane(-1)))
    path.write_text(document(body, header=head), encoding="utf-8")
    return path


@pytest.fixture
def files(tmp_path):
    """A slope, and an extract with a house."""
    north, east = np.meshgrid(np.arange(400), np.arange(400), indexing="ij")
    write_dem(tmp_path / "dem.tif", 40.0 + 0.04 * east + 0.0 * north, X - 200, Y + 200)
    extract = Extract(52.5, 13.4)
    extract.way([(-30, -20), (-20, -20), (-20, -30), (-30, -30), (-30, -20)], building="yes", height="7")
    extract.write(tmp_path / "around.osm")
    return tmp_path


def choose(scene, street, radius=40.0):
    bpy.ops.seip.choose_map(filepath=str(street))
    scene.seip.site.radius = radius
    return scene.seip.site


def shapes(scene):
    """Corners of all meshes in the world, by name and source."""
    return {
        (obj.name, obj.get(contract.SOURCE)): [tuple(obj.matrix_world @ corner.co) for corner in obj.data.vertices]
        for obj in scene.objects
        if obj.type == "MESH"
    }


@pytest.mark.slow
def test_the_panel_builds_what_the_batch_command_builds_of_the_same_files(scene, street, files):
    chosen = choose(scene, street)
    chosen.osm, chosen.terrain = str(files / "around.osm"), str(files / "dem.tif")
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    by_panel = shapes(scene)
    assert "extract" in {source for _, source in by_panel}
    middle = map(str, read_map(street).middle())
    build_scene.main(
        [
            *(str(street), "--near", *middle, "--radius", "40", "-o", str(files / "site.blend")),
            *("--osm", str(files / "around.osm"), "--terrain", str(files / "dem.tif")),
        ]
    )
    bpy.ops.wm.open_mainfile(filepath=str(files / "site.blend"))
    assert shapes(bpy.context.scene) == by_panel


def test_installed_costs_are_in_the_survey(junction, tmp_path):
    survey = junction.seip.survey
    assert survey.settings().installed_cost is None
    survey.installed = True
    assert survey.settings().installed_cost == load_installed_cost()
    (tmp_path / "mine.toml").write_text("new_post_usd = 9000\n", encoding="utf-8")
    survey.installed_cost = str(tmp_path / "mine.toml")
    assert survey.settings().installed_cost == load_installed_cost(tmp_path / "mine.toml")
    layout = DrawnLayout()
    junction.seip.sections.candidates = True
    placement.draw(layout, SimpleNamespace(scene=junction, region=None))
    assert "installed_cost" in {name for name, _ in layout.properties}
    survey.installed_cost = str(tmp_path / "none.toml")
    with pytest.raises(SeipError, match="cannot read the installed costs"):
        survey.settings()
    with pytest.raises(RuntimeError, match="cannot read the installed costs"):
        bpy.ops.seip.solve_placement()
