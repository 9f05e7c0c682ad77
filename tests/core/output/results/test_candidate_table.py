import csv

import pytest

from seip_addon.core.output.results.candidate_table import save_candidate_table


@pytest.fixture(scope="module")
def rows(example, tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "candidates.csv"
    save_candidate_table(path, example.site, example.models, example.visible, example.deployment)
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


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


def test_the_chosen_poses_carry_their_labels(example, rows):
    chosen = {int(row["pose"]): row["chosen"] for row in rows if row["chosen"]}
    assert chosen == {sensor.pose: sensor.label for sensor in example.deployment.sensors}
