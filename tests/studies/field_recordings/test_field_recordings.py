"""Verification of installations that differ from their plans in known ways, and the shipped recording of one."""

import json
from dataclasses import replace
from pathlib import Path

from headless.studies.field_recordings import command
from headless.studies.field_recordings.changed_site import ANGLE, DISTANCE, GAIN, RESOLUTION, changed_site
from headless.studies.field_recordings.draws import Draw, describe

import bpy
import numpy as np
import pytest

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

SCENES = Path(__file__).resolve().parents[3] / "scenes"
SHIPPED = SCENES / "junction_recording"
TRAFFIC = str(SCENES / "junction_traffic" / "run-9.npz")


@pytest.fixture(scope="module")
def plan():
    open_blend(SHIPPED / "plan.blend")
    return read_scene(bpy.context.scene).geometry, read_sensors(bpy.context.scene, load_catalogue(()))


def test_an_installation_is_off_by_the_stated_amounts(plan):
    geometry, planned = plan
    first, other = (changed_site(geometry, planned, np.random.default_rng(seed)) for seed in (1, 2))
    for site in (first, other):
        (sensor,), (intended,) = site.sensors, planned
        turned = sensor.orientation @ intended.orientation.T
        assert np.linalg.norm(sensor.xyz - intended.xyz) == pytest.approx(DISTANCE)
        assert np.arccos((np.trace(turned) - 1) / 2) == pytest.approx(ANGLE)
        assert sensor.model.law == intended.model.law.amplified(GAIN)
        before, after = ({mesh.name for mesh in one.occluders} for one in (geometry, site.geometry))
        assert before - after == {site.gone}
        assert len(after - before) == len(site.trees) == 2
    assert not np.allclose(first.trees, other.trees)


def test_the_shipped_recording_is_that_of_the_study(tmp_path):
    command.main([str(SHIPPED / "plan.blend"), "--traffic", TRAFFIC, "--example", "-o", str(tmp_path / "sweeps")])
    own, shipped = (sorted((folder / "S1").glob("*")) for folder in (tmp_path / "sweeps", SHIPPED / "sweeps"))
    assert [path.name for path in own] == [path.name for path in shipped]
    assert own[-1].read_text(encoding="utf-8") == shipped[-1].read_text(encoding="utf-8")
    for one, other in zip(own[:-1], shipped[:-1], strict=True):
        with np.load(one) as ours, np.load(other) as theirs:
            # Embree computes in single precision with code for the processor at hand: on another one, some coordinates
            # are rounded to the next step.
            moved = np.abs(ours["points"] - theirs["points"])
            assert moved[:, :3].max() <= RESOLUTION
            assert np.mean(moved > 0) < 1e-3
            assert not moved[:, 3].any()


def test_a_study_of_two_installations_finds_what_was_changed(tmp_path):
    folder = tmp_path / "field"
    command.main([str(SHIPPED / "plan.blend"), "--traffic", TRAFFIC, "--draws", "2", "-o", str(folder)])
    draws = json.loads((folder / "draws.json").read_text(encoding="utf-8"))["draws"]
    assert len(draws) == 2
    for draw in draws:
        assert draw["position"] < 0.01
        assert draw["rotation"] < 1e-3
        assert draw["building"] == draw["trees"] == 1.0
        assert 0.6 < draw["gain"] < 1.6


def test_figures_are_over_all_installations():
    draw = Draw(0.001, 1e-5, 1.0, 1.0, 1.0, 1.0, 1.0, 0)
    lines = describe([draw, replace(draw, position=0.003, trees=0.5, building=0.0, false_changes=3)])
    text = "\n".join(lines)
    assert "2 installations" in text
    assert "2.0 mm (largest 3.0 mm)" in text
    assert "trees found: 75%; missing building found: 50%" in text
    assert "false changes: 1.5 in each" in text
