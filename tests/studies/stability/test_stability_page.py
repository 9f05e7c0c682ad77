"""The page of stability and its chapters."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from headless.studies.stability.page import Chapter, Chart, load_chapter, save_chapter, save_page
from headless.studies.stability.rows import Row

import pytest

CHAPTER = Chapter(
    "Poses",
    (Row("coverage", "σ 0.3 m", "45 % [44 %, 46 %]", "500 draws", "warns | names the sensor"),),
    (Chart("spread.png", "Distribution"),),
)


def test_a_chapter_is_read_as_it_was_written(tmp_path: Path) -> None:
    save_chapter(tmp_path / "poses.json", CHAPTER, "abc")
    assert load_chapter(tmp_path / "poses.json", "abc") == CHAPTER


@pytest.mark.parametrize("text", [None, "", "{", "[]", '{"schema": "seip.stability", "version": 1, "key": "abc"}'])
def test_what_is_no_chapter_is_made_again(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "poses.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    assert load_chapter(path, "abc") is None


def test_a_chapter_made_from_something_else_is_made_again(tmp_path: Path) -> None:
    save_chapter(tmp_path / "poses.json", CHAPTER, "abc")
    assert load_chapter(tmp_path / "poses.json", "abd") is None


def test_the_page_holds_all_rows_and_charts(tmp_path: Path) -> None:
    other = replace(CHAPTER, title="Solvers", charts=())
    save_page(tmp_path / "stability.md", "The lead.", [CHAPTER, other], "stability")
    text = (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert text.startswith("# Stability\n\nThe lead.\n\n## Poses\n\n| Method |")
    assert r"| coverage | σ 0.3 m | 45 % [44 %, 46 %] | 500 draws | warns \| names the sensor |" in text
    assert "![Distribution](stability/spread.png)" in text
    assert text.index("## Poses") < text.index("## Solvers")


def test_the_shipped_page_says_differences_in_points() -> None:
    page = (Path(__file__).parents[3] / "docs" / "stability.md").read_text(encoding="utf-8")
    of_what = re.compile(r"(gives away|loses at most|loses up to|standard deviation|hides) [\d.]+%|%\] (more|of it)")
    assert [found.group() for found in of_what.finditer(page)] == []
    assert "points of planned coverage" in page
