import csv
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.output.results.candidate_table import COLUMNS, save_candidate_table
from tests.builders.small_junction import make_example


@pytest.fixture(scope="module")
def example():
    return make_example()


@pytest.fixture(scope="module")
def rows(example, tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "candidates.csv"
    save_candidate_table(path, example.site, example.models, example.visible, example.deployment)
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_there_is_one_row_for_each_pose_with_all_columns(example, rows):
    assert len(rows) == len(example.site.candidates)
    assert tuple(rows[0]) == COLUMNS
    assert [int(row["pose"]) for row in rows] == list(range(len(rows)))


def test_a_name_that_is_a_formula_is_written_as_text(example, tmp_path):
    names = example.site.candidates.position_name.astype("U64")
    names[:] = '=HYPERLINK("http://example.com")'
    site = replace(example.site, candidates=replace(example.site.candidates, position_name=names))
    save_candidate_table(tmp_path / "a.csv", site, example.models, example.visible, example.deployment)
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert '\'=HYPERLINK("http://example.com")' in {row["position"] for row in csv.DictReader(file)}


def test_rows_say_what_each_pose_sees_and_where_it_is(example, rows):
    candidates, weight = example.site.candidates, example.site.targets.weight
    for pose in (0, 17, len(rows) - 1):
        row, seen = rows[pose], example.visible[pose]
        assert int(row["targets_seen"]) == seen.sum()
        assert float(row["weighted_coverage"]) == pytest.approx(weight[seen].sum() / weight.sum(), abs=1e-6)
        there = [float(row[name]) for name in ("map_x_m", "map_y_m", "map_z_m")]
        assert there == pytest.approx((candidates.xyz[pose] + example.site.origin).tolist(), abs=6e-4)
        assert row["sensor"] == candidates.sensor[pose]
        assert row["position"] == candidates.position_name[candidates.position_of[pose]]
        assert row["pole_source"] == candidates.pole_source[candidates.position_of[pose]]


def test_ranks_are_a_permutation_that_falls_with_weighted_coverage(rows):
    ordered = sorted(rows, key=lambda row: int(row["rank"]))
    assert [int(row["rank"]) for row in ordered] == list(range(1, len(rows) + 1))
    assert np.all(np.diff([float(row["weighted_coverage"]) for row in ordered]) <= 0)


def test_the_chosen_poses_carry_their_labels(example, rows):
    chosen = {int(row["pose"]): row["chosen"] for row in rows if row["chosen"]}
    assert chosen == {sensor.pose: sensor.label for sensor in example.deployment.sensors}


def test_a_tilt_stands_beside_the_yaw(example, tmp_path):
    count = len(example.site.candidates)
    candidates = replace(example.site.candidates, tilt=np.radians(np.where(np.arange(count) % 2, 12.5, -3.0)))
    site, path = replace(example.site, candidates=candidates), tmp_path / "candidates.csv"
    save_candidate_table(path, site, example.models, example.visible, example.deployment)
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    assert [row["tilt_deg"] for row in rows[:2]] == ["-3.000", "12.500"]
    assert COLUMNS[COLUMNS.index("yaw_deg") + 1] == "tilt_deg"
