"""Average precision of a placement at a site of the open benchmark, on the small scene with its traffic."""

import re
import shutil

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.studies.open_benchmark import command

import bpy

from seip_addon.scene import contract
from seip_addon.scene.blend_file import open_blend

EVERY = 15.0
PLACES = ((6.5, -5.25, 4.0), (-6.5, 5.25, 4.0))  # float32, as a .blend has them


@pytest.fixture(scope="module")
def site(small_scene, tmp_path_factory):
    """The small scene as a site of the benchmark that has been built."""
    folder = tmp_path_factory.mktemp("benchmark") / "borough"
    folder.mkdir()
    shutil.copy(small_scene, folder / "site.blend")
    shutil.copytree(small_scene.parent / "small_traffic", folder / "site_traffic")
    return folder


@pytest.fixture(scope="module")
def placed(site):
    path = site.parent / "placed.blend"
    open_blend(site / "site.blend")
    collection = contract.find_or_make(bpy.context.scene, contract.SENSORS)
    for number, place in enumerate(PLACES, start=1):
        obj = bpy.data.objects.new(f"sensor {number}", None)
        obj.location, obj[contract.LABEL], obj[contract.SENSOR] = place, f"S{number}", "os1_128"
        collection.objects.link(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_the_command_ranks_a_placement_among_those_of_the_table(site, placed, capsys, monkeypatch):
    monkeypatch.setattr(command, "EVERY", EVERY)
    command.main(["--placement", "borough", str(placed), "-o", str(site.parent)])
    said = capsys.readouterr()
    assert ("another detector" in said.out + said.err) == (
        Detector.load(SHIPPED_DETECTOR).key != command.TABLE_DETECTOR
    )
    (line,) = (line for line in said.out.splitlines() if line.startswith("vehicles"))
    assert re.search(r"average precision [\d.]+% .* above \d+ of 106 placements of 2 × os1_128", line)
