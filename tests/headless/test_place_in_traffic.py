"""Placement over instants of traffic by the command, from a scene and its runs to the folder of its result."""

import json
from unittest.mock import patch

from headless import place

import numpy as np
import pytest

from seip_addon.core.choosing.placement.scenarios import DEFAULT_COUNTS
from seip_addon.core.output.results.file_names import TRAFFIC_PICTURE
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.scene.result_folder import FILES
from tests.builders.small_junction import ORIGIN

COARSE = ["--sensor", "vlp16", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--no-render"]


@pytest.fixture(scope="module")
def run(small_scene):
    def run(folder, *options):
        with patch.dict(DEFAULT_COUNTS, traffic=(4, 24)):
            place.main([str(small_scene), "-o", str(folder), *COARSE, "--traffic", *options])

    return run


def trajectories(path, *, x=0.0, end=30.0):
    """Write a run of one car that stands somewhere."""
    Trajectories(
        users=(RoadUser("car", "car", 4.5, 1.8, 1.5),),
        origin=np.zeros(3),
        first=np.array([0, 2]),
        time=np.array([0.0, end]),
        position=np.array([[x, 0.0, 0.0]] * 2) + ORIGIN,
        yaw=np.zeros(2),
        pitch=np.zeros(2),
        speed=np.zeros(2),
    ).save(path)
    return str(path)


def test_it_writes_a_result_and_says_what_traffic_hides(tmp_path, capsys, run):
    run(tmp_path, "--count", "2")
    names = {path.name for path in tmp_path.iterdir()}
    assert {*FILES, TRAFFIC_PICTURE, "visibility.npz"} - {"view.png"} <= names
    record = json.loads((tmp_path / "placement.json").read_text(encoding="utf-8"))
    goal, notes = record["settings"]["goal"], record["notes"]
    assert goal["scenarios"]["kind"] == "traffic"
    assert "in traffic, on average over 4 instants" in notes[0]
    said = capsys.readouterr().out
    assert "chosen for the empty road: " in said
    assert "vehicles of one run within 1 m of one of another at the same instant: " in said
    assert any(note.startswith("this placement sees ") and note in said for note in notes)
