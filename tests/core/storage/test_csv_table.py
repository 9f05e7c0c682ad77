"""CSV tables: texts that a spreadsheet would take for a formula are not one."""

import csv

import pytest

from seip_addon.core.storage.csv_table import save_csv


@pytest.mark.parametrize(
    "name",
    [
        '=HYPERLINK("http://example.com","post")',
        "+1+cmd|' /C calc'!A0",
        "  =1",
        "\N{FULLWIDTH EQUALS SIGN}1",
    ],
)
def test_a_formula_is_written_as_text(tmp_path, name):
    save_csv(tmp_path / "a.csv", ["name"], [[name]])
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["name"], [f"'{name}"]]


def test_a_carriage_return_begins_no_row(tmp_path):
    save_csv(tmp_path / "a.csv", ["name", "x"], [["post\r=1+1", 2]])
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["name", "x"], ["post =1+1", "2"]]


@pytest.mark.parametrize("value", ["-3.500", "-10 -5 0", "signal pole 1", -3.5])
def test_numbers_and_ordinary_names_stay_as_they_are(tmp_path, value):
    save_csv(tmp_path / "a.csv", ["value", "x"], [[value, 1]])
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == f"value,x\n{value},1\n"
