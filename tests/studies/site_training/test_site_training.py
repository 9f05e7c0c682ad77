"""Training on random placements at several sites."""

from shutil import copyfile

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection.detector import Detector
from headless.detection.recordings import poses_key
from headless.detection.settings import NetworkSettings
from headless.studies.site_training import command as train_on_sites
from headless.studies.site_training.command import HEIGHTS, MAX_SENSORS, TILTS, candidates_of_types, random_placement

import numpy as np

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from tests.builders.small_junction import make_example

BRIEF = ["--steps", "2", "--batch", "2", "--every", "15", "--sensor", "type1"]
SMALL = NetworkSettings(width=8, blocks=(0, 0, 0))


@pytest.fixture(autouse=True)
def _small_network(monkeypatch):
    monkeypatch.setattr(train_on_sites, "NETWORK", SMALL)


@pytest.fixture(scope="module")
def sites(small_scene, tmp_path_factory):
    """Two scenes, each with a run of traffic of its own."""
    folder = tmp_path_factory.mktemp("sites")
    runs = sorted((small_scene.parent / "small_traffic").iterdir())
    for number in range(2):
        copyfile(small_scene, folder / f"site-{number}.blend")
        (folder / f"site-{number}_traffic").mkdir()
        copyfile(runs[number], folder / f"site-{number}_traffic" / "run-1.npz")
    return [str(path) for path in sorted(folder.glob("*.blend"))]


def test_a_detector_is_trained_and_the_same_again(sites, tmp_path):
    for output in ("one", "other"):
        train_on_sites.main([*sites, *BRIEF, "-o", str(tmp_path / output)])
    one, other = ((tmp_path / output / "detector.pt").read_bytes() for output in ("one", "other"))
    assert one == other
    detector = Detector.load(tmp_path / "one" / "detector.pt")
    assert detector.training_record.sensors == ("type1",)
    assert (tmp_path / "one" / "training.png").read_bytes().startswith(b"\x89PNG")
    weights = detector.state_dict()["feature_map.encoder.linear.weight"]
    assert (weights == weights.half().float()).all()


def test_random_placements_are_of_different_positions_and_all_poses():
    example = make_example()
    models = example.models
    candidates = dict.fromkeys(models, example.site.candidates)
    random = np.random.default_rng(3)
    drawn = [random_placement("one", candidates, models, random) for _ in range(200)]
    counts = {len(one.sensors) for one in drawn}
    assert counts == set(range(1, min(MAX_SENSORS, len(example.site.candidates.position)) + 1))
    poses = {tuple(place) for place in example.site.candidates.xyz.tolist()}
    for one in drawn:
        places = [tuple(sensor.xyz.tolist()) for sensor in one.sensors]
        assert len(set(places)) == len(places)
        assert set(places) <= poses
    assert {tuple(sensor.xyz.tolist()) for one in drawn for sensor in one.sensors} == poses
    again = np.random.default_rng(3)
    assert [poses_key(one) for one in drawn[:5]] == [
        poses_key(random_placement("one", candidates, models, again)) for _ in range(5)
    ]


def test_every_type_of_the_catalogue_has_candidates_at_the_same_positions():
    models = load_catalogue(())
    candidates = candidates_of_types(make_example().geometry, models)
    assert set(candidates) == set(models)
    (positions,) = {tuple(np.unique(own.position_of).tolist()) for own in candidates.values()}
    assert len(positions) > MAX_SENSORS
    full, part = candidates["os1_128"], candidates["at128"]
    assert len(full) == len(positions) * len(HEIGHTS) * len(TILTS) < len(part)
