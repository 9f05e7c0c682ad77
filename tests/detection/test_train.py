"""The command from folders of scans to a detector, its curve and its figures."""

import json
import math
import shutil

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import simulate, train
from headless.detection.detector import Detector
from headless.detection.settings import NetworkSettings

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.write import write_result
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import ORIGIN, make_example

SMALL = NetworkSettings(width=8, blocks=(1, 1, 1))


@pytest.fixture(autouse=True)
def _small_network(monkeypatch):
    monkeypatch.setattr(train, "NETWORK", SMALL)


def make_traffic(source, start) -> Trajectories:
    """Return a car that drives along +x from ``start``."""
    times = np.arange(4) / 5
    return Trajectories(
        users=(RoadUser("car", "car", 4.5, 1.8, 1.5),),
        origin=np.zeros(3),
        first=np.array([0, 4]),
        time=times,
        position=np.column_stack([start + 10 * times, np.full(4, -3.5), np.zeros(4)]) + ORIGIN,
        yaw=np.zeros(4),
        pitch=np.zeros(4),
        speed=np.full(4, 10.0),
        source=source,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A placed scene and three runs of scans in it."""
    folder = tmp_path_factory.mktemp("train")
    example = make_example()
    write_result(make_scene(example.geometry), example.site, example.deployment)
    save_blend(folder / "placed.blend")
    for name, start in (("first", -20.0), ("second", -5.0), ("third", 8.0)):
        make_traffic(f"simulated, {name}", start).save(folder / f"{name}.npz")
        arguments = [str(folder / "placed.blend"), "--traffic", str(folder / f"{name}.npz")]
        simulate.main([*arguments, "--duration", "0.2", "-o", str(folder / name)])
    return folder


def arguments(folder, output, *, training="first", validation="second", test="third", more=()):
    runs = ["--train", str(folder / training), "--validation", str(folder / validation), "--test", str(folder / test)]
    return [str(folder / "placed.blend"), *runs, "-o", str(folder / output), "--steps", "4", *more]


def test_a_detector_its_curve_and_its_figures_are_written_once(folder, capsys):
    train.main(arguments(folder, "detector"))
    detector = Detector.load(folder / "detector" / "detector.pt")
    assert detector.settings.width == 8
    assert (folder / "detector" / "training.png").read_bytes().startswith(b"\x89PNG")
    figures = json.loads((folder / "detector" / "evaluation.json").read_text(encoding="utf-8"))
    assert list(figures) == [str(folder / "third")]
    assert all(0 <= value <= 1 and math.isfinite(value) for value in figures[str(folder / "third")].values())
    said = capsys.readouterr().out
    assert "pillars of 0.32 m" in said
    assert "vehicles of one run within 1 m of one of another at the same instant: " in said
    before = (folder / "detector" / "detector.pt").stat().st_mtime_ns
    train.main(arguments(folder, "detector"))
    assert (folder / "detector" / "detector.pt").stat().st_mtime_ns == before
    with pytest.raises(SeipError, match="other settings"):
        train.main(arguments(folder, "detector", more=("--seed", "7")))


def test_the_same_traffic_under_another_name_is_refused(folder):
    shutil.copytree(folder / "first", folder / "copy")
    manifest = folder / "copy" / "manifest.json"
    record = json.loads(manifest.read_text(encoding="utf-8"))
    record["trajectories"]["source"] = "elsewhere"
    manifest.write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(SeipError, match=r"first and .*copy are nearly the same traffic: 100% of the vehicles"):
        train.main(arguments(folder, "leak", test="copy"))
    assert not (folder / "leak").exists()


def test_what_is_no_run_and_no_device_is_refused(folder):
    with pytest.raises(SeipError, match="does not contain a run of scans"):
        train.main(arguments(folder, "none", test="nowhere"))
    with pytest.raises(SeipError, match="PyTorch cannot use the device 'abacus'"):
        train.main(arguments(folder, "none", more=("--device", "abacus")))
