"""The study command, from a scene to its charts, tables and plans."""

import csv

from headless.studies.coverage import command as study
from headless.studies.coverage.cells import CENTRAL_WEIGHTS, COUNTS

import pytest
from matplotlib.image import imread

pytestmark = pytest.mark.slow  # a whole study; its parts are in test_coverage_study.py and test_study_claims.py

TYPES, HEIGHTS = ("type1", "type2"), (3.5, 8.0)
COARSE = ["--sensor", *TYPES, "--heights", *map(str, HEIGHTS), "--grid", "5", "--spacing", "20"]


@pytest.fixture(scope="module")
def run(small_scene):
    def run(folder, *options):
        study.main([str(small_scene), "-o", str(folder), *COARSE, *options])

    return run


@pytest.fixture(scope="module")
def folder(tmp_path_factory, run):
    folder = tmp_path_factory.mktemp("study")
    run(folder)
    return folder


def test_the_folder_holds_charts_tables_and_plans(folder):
    plans = {f"plan_{sensor}_{kind}.png" for sensor in TYPES for kind in ("vanilla", "weighted")}
    names = {path.name for path in folder.iterdir()}
    assert names == {"visibility.npz", "coverage.csv", "claims.md", "heights.png", "weights.png", *plans}
    for name in ("heights.png", "weights.png", *plans):
        assert imread(folder / name).shape[1] > 1000


def test_the_table_has_a_row_for_each_cell(folder):
    rows = list(csv.DictReader((folder / "coverage.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == len(TYPES) * len(COUNTS) * (len(HEIGHTS) + 1 + len(CENTRAL_WEIGHTS))
    for row in rows:
        assert 0 < float(row["coverage"]) <= 1
        assert float(row["objective"]) <= float(row["bound"])
        if row["height_m"] != "free":
            assert {float(height) for height in row["heights_used_m"].split()} == {float(row["height_m"])}


def test_the_verdicts_stand_in_the_claims(folder):
    lines = (folder / "claims.md").read_text(encoding="utf-8").splitlines()
    assert [line.split("|")[1].strip() for line in lines[4:]] == ["1", "2", "3", "4", "10"]
    assert all(line.count("**") == 2 for line in lines[4:])
