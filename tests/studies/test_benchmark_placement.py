"""Average precision of a placement at a site of the open benchmark, on the small scene with its traffic."""

import re
import shutil

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import survey
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.rules import RULES, precision_by
from headless.studies.detection.case_study import split_untrained
from headless.studies.open_benchmark import command
from headless.studies.open_benchmark.placement import placement_precision
from headless.studies.stored_detections import stored_detections

import bpy
import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.scene import contract
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene

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


def precision(site, *, rolling_shutter):
    """Average precision of vehicles with the sensors at `PLACES`, which no file has passed on."""
    model = load_catalogue()["os1_128"]
    sensors = tuple(
        MountedSensor(f"S{number}", model, np.array(place), np.eye(3)) for number, place in enumerate(PLACES, start=1)
    )
    open_blend(site / "site.blend")
    geometry = read_scene(bpy.context.scene).geometry
    _, tests = split_untrained(sampled_runs(survey.runs_beside(site / "site.blend"), geometry.origin, EVERY))
    simulator = Simulator(geometry, ScanSettings(rolling_shutter=rolling_shutter), sensors)
    detector = Detector.load(SHIPPED_DETECTOR)
    folder = site.parent / f"direct-{rolling_shutter}"
    (frames,) = finish(stored_detections(simulator, MountedSensors("direct", sensors), [detector], tests, folder))
    return precision_by(frames, RULES["bev_0.7"]).average_precision


def test_precision_is_that_of_the_same_sensors_with_a_rolling_shutter(site, placed):
    found, sensors = finish(placement_precision(site, placed, EVERY, site.parent / "out"))
    assert sensors == ("os1_128", "os1_128")
    assert found["vehicles"].value == precision(site, rolling_shutter=True) > 0
    # At both shutters the precision may be the same; the files of the detections are named by digests of the scans.
    precision(site, rolling_shutter=False)
    stored, rolling, frozen = (
        {path.name for path in (site.parent / name).rglob("*.npz")} for name in ("out", "direct-True", "direct-False")
    )
    assert stored == rolling != frozen
    assert set(found) == {"vehicles"}  # there are no other road users in this traffic


def test_the_command_ranks_a_placement_among_those_of_the_table(site, placed, capsys, monkeypatch):
    monkeypatch.setattr(command, "EVERY", EVERY)
    command.main(["--placement", "borough", str(placed), "-o", str(site.parent)])
    said = capsys.readouterr()
    assert ("another detector" in said.out + said.err) == (
        Detector.load(SHIPPED_DETECTOR).key != command.TABLE_DETECTOR
    )
    (line,) = (line for line in said.out.splitlines() if line.startswith("vehicles"))
    assert re.search(r"average precision [\d.]+% .* above \d+ of 106 placements of 2 × os1_128", line)


def test_a_site_that_was_not_built_and_a_scene_without_sensors_are_refused(site, tmp_path):
    with pytest.raises(SeipError, match="build the benchmark first, with --build --site other"):
        finish(placement_precision(tmp_path / "other", site / "site.blend", EVERY, tmp_path))
    with pytest.raises(SeipError, match="no sensor"):
        finish(placement_precision(site, site / "site.blend", EVERY, tmp_path))
