"""Scores of criteria on the open benchmark, by hand and on the shipped table."""

import csv
import math

from headless.studies.open_benchmark import command
from headless.studies.open_benchmark.sites import read_sites
from headless.studies.open_benchmark.table import (
    AP,
    COLUMNS,
    CRITERIA,
    criterion_column,
    read_criterion,
    read_table,
    score,
)

import pytest

from seip_addon.core.base.errors import SeipError

PRECISION = {"one": [0.2, 0.4, 0.6, 0.8], "two": [0.9, 0.7, 0.5, 0.1]}


@pytest.fixture
def table(tmp_path):
    """Two sites of four placements; the first alone has pedestrians. Coverage agrees with its precision only."""
    path = tmp_path / "placements.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.DictWriter(file, COLUMNS)
        rows.writeheader()
        for site, values in PRECISION.items():
            for number, value in enumerate(values, start=1):
                row = dict.fromkeys(COLUMNS, "") | {"site": site, "placement": number, "kind": "random"}
                row |= {"sensors": "0 0 5", AP["vehicles"]: value, "coverage": number}
                rows.writerow(row | ({AP["pedestrians"]: value} if site == "one" else {}))
    return path


def write(path, values):
    lines = [f"{site},{number},{value}" for site, own in values.items() for number, value in enumerate(own, start=1)]
    path.write_text("\n".join(["site,placement,value", *lines, ""]), encoding="utf-8")
    return path


def test_rank_correlation_and_loss_are_means_over_sites(table):
    rows = read_table(table)
    found = {one.road_users: one for one in score(table, rows, criterion_column(table, rows, "coverage"))}
    assert set(found) == {"vehicles", "pedestrians"}
    vehicles, pedestrians = found["vehicles"], found["pedestrians"]
    assert (vehicles.sites, pedestrians.sites) == (2, 1)
    assert vehicles.spearman.value == pytest.approx(0.0)  # 1 at one site, -1 at the other
    assert pedestrians.spearman.value == pytest.approx(1.0)
    assert vehicles.loss.value == pytest.approx((0.0 + 0.8) / 2)
    # Student's quantile for one degree of freedom is 12.706
    assert vehicles.loss.high - vehicles.loss.value == pytest.approx(
        12.706 * 0.4 * math.sqrt(2) / math.sqrt(2), rel=1e-3
    )
    assert math.isinf(pedestrians.loss.high)


def test_criterion_is_read_in_any_order_of_rows(table, tmp_path):
    path = write(tmp_path / "mine.csv", {"two": [4, 3, 2, 1]})
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([lines[0], *reversed(lines[1:])]), encoding="utf-8-sig")
    assert read_criterion(path, read_table(table))["two"].tolist() == [4.0, 3.0, 2.0, 1.0]


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"three": [1, 2]}, "no placement 1 at three"),
        ({"one": [1, 2, 3, 4, 5]}, "no placement 5 at one"),
        ({"one": [1, 2, 3]}, "placement 4 at one is missing"),
        ({"one": [1, 2, "nan", 4]}, "value of placement 3 at one is 'nan', not a number"),
        ({}, "has no column 'site'"),
    ],
)
def test_faulty_values_of_a_criterion_are_refused(table, tmp_path, values, fault):
    with pytest.raises(SeipError, match=fault):
        read_criterion(write(tmp_path / "mine.csv", values), read_table(table))


def test_command_prints_the_given_criterion_beside_those_of_the_table(table, tmp_path, capsys):
    path = write(tmp_path / "perfect.csv", PRECISION)
    command.main(["--criterion", str(path), "--table", str(table)])
    lines = capsys.readouterr().out.splitlines()
    perfect = next(line for line in lines if line.startswith("perfect") and "vehicles" in line)
    assert "Spearman +1.00 [+1.00, +1.00]  loss 0.0 [0.0, 0.0]" in perfect
    assert any(line.startswith("coverage") for line in lines)


def test_shipped_table_has_ten_sites_with_100_placements_and_all_criteria():
    table = read_table(command.TABLE)
    assert list(table) == [site.name for site in read_sites()]
    for site, rows in table.items():
        assert len(rows) >= 100, site
        assert all(len(row["sensors"].split(";")) == command.COUNT for row in rows)
        assert all(0.0 <= float(row[AP["vehicles"]]) <= 1.0 for row in rows)
        assert all(row[key] for row in rows for key in CRITERIA)
