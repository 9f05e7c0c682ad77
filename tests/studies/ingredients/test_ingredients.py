"""What each ingredient of a training for unseen sites gains."""

import csv
from dataclasses import replace
from shutil import copyfile

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection.detection_area import area_of
from headless.detection.recordings import SampledRun, Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.studies.ingredients import command as compare_ingredients
from headless.studies.ingredients.learning import COUNT, SENSOR, TrainingSites, train_variants
from headless.studies.ingredients.unseen_sites import unseen_tests
from headless.studies.ingredients.variants import (
    ALL,
    FEW_SITES,
    SIZE_CHANGE,
    VARIANTS,
    Ingredients,
    ScanIngredients,
    with_bodies,
)
from headless.studies.simulated_recordings import poses_key
from headless.studies.site_training.training_site import TrainingSite

import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.world.traffic_simulation.demand import MODELS
from tests.builders.sloping_road import hill
from tests.builders.small_junction import make_geometry
from tests.builders.small_scene import make_run
from tests.builders.street_clouds import street_frame

SMALL = NetworkSettings(width=8, blocks=(0, 0, 0))
TIMES = np.array([2.0, 17.0])


def a_site(number, runs=2):
    geometry = replace(make_geometry(36.0), name=f"site {number}")
    candidates = CandidateSettings(sensors=("type1",), heights=(4.0, 6.0))
    layout = lay_out(geometry, SurveySettings(candidates=candidates))
    sampled = tuple(
        SampledRun(f"run-{run}", make_run(10 * number + run, 30.0).moved_to(geometry.origin), TIMES)
        for run in range(runs)
    )
    return TrainingSite(
        f"site {number}",
        geometry,
        layout.site.candidates,
        layout.models,
        sampled,
        Simulator(geometry, ScanSettings(seed=1)),
    )


@pytest.fixture(scope="module")
def sites(tmp_path_factory):
    """Three sites to learn from, and one to see when to stop."""
    return TrainingSites(
        tuple(a_site(number) for number in (1, 2, 3)), (a_site(4),), tmp_path_factory.mktemp("sites"), 5
    )


def placements(scans):
    """The digests of placements by the name of the site."""
    found = {}
    for site, recording in scans:
        found.setdefault(site.name, []).append(recording.placement)
    return found


def test_each_variant_leaves_out_one_ingredient():
    assert VARIANTS[ALL] == Ingredients()
    whole = Ingredients()
    changed = [
        {
            name
            for one, other in ((whole, variant), (whole.scans, variant.scans))
            for name in vars(one)
            if name != "scans" and vars(one)[name] != vars(other)[name]
        }
        for variant in VARIANTS.values()
    ]
    assert list(map(len, changed)) == [0, 1, 1, 1, 1, 1, 1]
    assert set.union(*changed) == {*vars(whole), *vars(whole.scans)} - {"scans"}


def test_without_the_background_taken_out_clouds_keep_all_returns():
    area = area_of(hill(0.0, 0.0, 0.0), 0.4)
    frame = street_frame(3)
    kept = Ingredients(foreground=False).area(area).cloud(frame)
    assert len(area.cloud(frame)) < len(kept) == area.grid.holds(frame.points).sum()
    np.testing.assert_array_equal(Ingredients().area(area).cloud(frame), area.cloud(frame))


def test_heights_above_one_level_are_those_above_the_mean_of_the_road():
    area = area_of(hill(), 0.4)
    level = Ingredients(levelled=False).area(area)
    boxes = np.column_stack([np.random.default_rng(2).uniform(-15, 15, (50, 3)), np.ones((50, 4))])
    below = boxes[:, 2] - level.levelled(boxes)[:, 2]
    np.testing.assert_allclose(below, 100.0, atol=0.1)
    assert np.ptp(below) < 1e-9 < np.ptp(boxes[:, 2] - area.levelled(boxes)[:, 2])


def test_bodies_of_models_are_those_of_the_nearest_model():
    trajectories = make_run(3, 30.0)
    shaped = tuple(replace(user, shape=(0.1, 0.0, 0.1, 0.0)) for user in trajectories.users)
    before = SampledRun("run", replace(trajectories, users=shaped), TIMES)
    run = finish(with_bodies(before, ScanIngredients(varied_bodies=False), 1))
    known = {category: {model[2:5] for model in models.values()} for category, models in MODELS.items()}
    for own, user in zip(shaped, run.trajectories.users, strict=True):
        size = (user.length, user.width, user.height)
        assert size in known[user.category] | {(own.length, own.width, own.height)}
        assert user.shape == (0.0, 0.0, 0.0, 0.0)
        nearest = min(known[user.category], key=lambda other: abs(np.log(other[0] / own.length)))
        assert abs(user.length - nearest[0]) < 0.5
    np.testing.assert_array_equal(run.trajectories.position, trajectories.position)
    assert finish(with_bodies(before, ScanIngredients(), 1)) is before


def test_resized_bodies_differ_by_the_share_at_most():
    run = SampledRun("run", make_run(3, 30.0), TIMES)
    other = finish(with_bodies(run, ScanIngredients(resized=SIZE_CHANGE), 1))
    ratios = [b.width / a.width for a, b in zip(run.trajectories.users, other.trajectories.users, strict=True)]
    assert 0.02 < max(map(abs, np.array(ratios) - 1)) <= SIZE_CHANGE + 1e-3


def test_few_sites_are_scanned_as_often_as_many(sites):
    many = placements(finish(sites.scans(ScanIngredients())))
    few = placements(finish(sites.scans(ScanIngredients(many_sites=False))))
    assert list(many) == ["site 1", "site 2", "site 3"]
    assert list(few) == ["site 1", "site 2"] == list(many)[:FEW_SITES]
    whole = TrainingSites(tuple(a_site(number) for number in (1, 2, 3, 4)), (), sites.store, sites.seed)
    more = placements(finish(whole.scans(ScanIngredients(many_sites=False))))
    assert sum(map(len, more.values())) == sum(map(len, placements(finish(whole.scans(ScanIngredients()))).values()))
    assert all(len(set(some)) == len(some) for some in more.values())


@pytest.mark.slow
def test_one_placement_at_each_site_covers_most(sites):
    one = TrainingSites(sites.training[:1], sites.validation, sites.store, sites.seed)
    scans = finish(one.scans(ScanIngredients(random_placements=False)))
    assert all(len(some) == 2 and len(set(some)) == 1 for some in placements(scans).values())
    assert all(recording.sensors == (SENSOR,) for _, recording in scans)
    assert str(COUNT) in scans[0][1].name


def test_variants_share_their_scans(sites, monkeypatch):
    asked = []
    frame = Simulator.frame
    monkeypatch.setattr(Simulator, "frame", lambda self, *which: asked.append(which[2]) or frame(self, *which))
    variants = {name: VARIANTS[name] for name in (ALL, "background left in", "heights above one level")}
    training = TrainingSettings(steps=1, batch=2, validate_every=1)
    two = TrainingSites(sites.training[:2], sites.validation, sites.store, sites.seed)
    detectors = finish(train_variants(two, variants, SMALL, training, 2))
    assert len(asked) == len(TIMES) * (2 * 2 + 2)
    assert {name: len(own) for name, own in detectors.items()} == dict.fromkeys(variants, 2)
    keys = {one.key for own in detectors.values() for one in own}
    assert len(keys) == 4  # the small junction is level
    asked.clear()
    again = finish(train_variants(two, variants, SMALL, training, 2))
    assert {one.key for own in again.values() for one in own} == keys


def test_full_tests_have_other_sensors_and_other_sizes():
    site = a_site(7, runs=3)
    best = site.random_placement(1, np.random.default_rng(0))
    (alone,) = unseen_tests(site, best, 1, full=False)
    same, drawn, others = unseen_tests(site, best, 1, full=True)
    assert [run.name for run, _ in alone.scanned] == [run.name for run, _ in same.scanned]
    assert len({poses_key(sensors) for _, sensors in same.scanned}) == 1
    assert len({poses_key(sensors) for _, sensors in drawn.scanned}) == 3
    for (before, _), (after, sensors) in zip(same.scanned, others.scanned, strict=True):
        assert poses_key(sensors) == poses_key(best)
        ratios = [
            new.length / old.length
            for old, new in zip(before.trajectories.users, after.trajectories.users, strict=True)
        ]
        assert max(map(abs, np.array(ratios) - 1)) <= SIZE_CHANGE + 1e-3
        assert np.ptp(ratios) > SIZE_CHANGE / 3


@pytest.mark.slow
def test_the_command_writes_table_and_chart(small_scene, tmp_path, monkeypatch, capsys):
    variants = {name: VARIANTS[name] for name in (ALL, "background left in")}
    monkeypatch.setattr(compare_ingredients, "VARIANTS", variants)
    runs = sorted((small_scene.parent / "small_traffic").iterdir())
    for number in range(2):
        copyfile(small_scene, tmp_path / f"site-{number}.blend")
        (tmp_path / f"site-{number}_traffic").mkdir()
        copyfile(runs[number], tmp_path / f"site-{number}_traffic" / "run-1.npz")
    scenes = [str(tmp_path / f"site-{number}.blend") for number in range(2)]
    out = tmp_path / "out"
    asked = ["--unseen", str(small_scene), "-o", str(out), "--every", "6", "--steps", "2", "--batch", "2"]
    compare_ingredients.main([*scenes, *asked, "--trainings", "1"])
    with (out / "ingredients.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(variants)
    for row in rows:
        assert 0 <= float(row["ap_low"]) <= float(row["ap"]) <= float(row["ap_high"]) <= 1
        assert (row["change"] == "") == (row["variant"] == ALL)
    assert (out / "ingredients.png").read_bytes().startswith(b"\x89PNG")
    assert "against all" in capsys.readouterr().out
    with pytest.raises(SeipError, match="two sites or more"):
        compare_ingredients.main([scenes[0], *asked])
