"""The command that compares criteria over sites, types and counts."""

import csv
import json

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection import shared_scans
from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.studies.criteria import command as criteria_study
from headless.studies.criteria.criteria_table import difference_of, in_halves

import numpy as np

from seip_addon.core.base.estimates import student_quantile
from tests.builders.labelled_frames import box, detected, frame, truth

OPTIONS = ["--sensor", "type1", "--count", "1", "2", "--placements", "4", "--every", "30", "--effort", "1"]
COARSE = ["--heights", "4", "5.4", "--grid", "8", "--spacing", "10"]
CARS = [box(20.0 * number) for number in range(10)]


@pytest.fixture(scope="module")
def study(small_scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("criteria")
    criteria_study.main([str(small_scene), "-o", str(folder), *COARSE, *OPTIONS])
    return folder


def test_table_holds_every_cell_criterion_and_class(study):
    rows = list(csv.DictReader((study / "criteria.csv").read_text(encoding="utf-8").splitlines()))
    criteria = ["coverage", "returns", "S-MIG", "EGVS", "InSPE", "PE-VGOP"]
    classes = ["vehicles"]  # there are no other road users in this traffic
    cells = [(row["count"], row["road_users"], row["criterion"]) for row in rows]
    assert cells == [(count, name, one) for count in "12" for name in classes for one in criteria]
    assert all(float(row["gain"]) == 0 for row in rows if row["criterion"] == "coverage")
    record = json.loads((study / "criteria.json").read_text(encoding="utf-8"))
    assert record["schema"] == "seip-criteria-study/1"
    (studied,) = record["types"]
    for count in (1, 2):
        placed = [one for one in studied["placements"] if one["count"] == count]
        sets = [frozenset(one["poses"]) for one in placed]
        assert len(set(sets)) == len(sets)
        best = [one for one in placed if one["kind"].startswith("best by")]
        assert len(placed) == len(best) + 4
        for key, name in (("coverage", "coverage"), ("returns", "returns"), ("occupancy_entropy", "S-MIG")):
            (own,) = [one for one in best if name in one["kind"].removeprefix("best by ").split(", ")]
            assert own["criteria"][key] == pytest.approx(max(one["criteria"][key] for one in placed), abs=1e-6)


def test_a_finished_study_is_read_and_a_stopped_one_goes_on(study, small_scene, capsys, monkeypatch):
    before = (study / "criteria.json").read_bytes()

    def refuse(*_):
        raise AssertionError("detected again")

    monkeypatch.setattr(shared_scans, "detect", refuse)
    criteria_study.main([str(small_scene), "-o", str(study), *COARSE, *OPTIONS])
    assert (study / "criteria.json").read_bytes() == before
    (study / small_scene.stem / "type1" / "criteria.json").unlink()
    criteria_study.main([str(small_scene), "-o", str(study), *COARSE, *OPTIONS])
    then = json.loads((study / "criteria.json").read_text(encoding="utf-8"))["types"][0]
    assert then["rows"] == json.loads(before)["types"][0]["rows"]
    assert "2 × type1, PE-VGOP" in capsys.readouterr().out


def found(counts):
    """Runs of a frame each with ten cars, of which so many are found."""
    frames = [
        frame(truth(CARS), detected(CARS[:count], [0.9] * count), run=f"run {number}")
        for number, count in enumerate(counts)
    ]
    return evaluate(frames, Rule())


def test_difference_is_the_jackknife_of_pairs():
    """Without a run the difference is the mean of the others'; of pairs that all differ by one car it is certain."""
    certain = difference_of(found([9, 8, 7, 6]), found([8, 7, 6, 5]))
    assert (certain.value, certain.low, certain.high) == pytest.approx((0.1, 0.1, 0.1))
    change = difference_of(found([9, 8, 7, 6]), found([9, 7, 7, 4]))
    left_out = np.array([3, 2, 3, 1]) / 30
    reach = student_quantile(3) * np.sqrt(3 / 4 * ((left_out - left_out.mean()) ** 2).sum())
    assert change.value == pytest.approx(3 / 40)
    assert (change.low, change.high) == pytest.approx((3 / 40 - reach, 3 / 40 + reach))


@pytest.mark.parametrize("counts", [[9, 8, 7, 6], [10, 2, 5, 4, 0]])
def test_halves_are_evaluated_by_themselves(counts):
    half = (len(counts) + 1) // 2
    alone = [found(counts[:half]).average_precision, found(counts[half:]).average_precision]
    assert in_halves(found(counts)).tolist() == pytest.approx(alone)
