"""The page of stability and its chapters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from headless.studies.stability.page import Chapter, Chart, save_page
from headless.studies.stability.rows import Row

CHAPTER = Chapter(
    "Poses",
    (Row("coverage", "σ 0.3 m", "45 % [44 %, 46 %]", "500 draws", "warns | names the sensor"),),
    (Chart("spread.png", "Distribution"),),
)


def test_the_page_holds_all_rows_and_charts(tmp_path: Path) -> None:
    other = replace(CHAPTER, title="Solvers", charts=())
    save_page(tmp_path / "stability.md", "The lead.", [CHAPTER, other], "stability")
    text = (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert text.startswith("# Stability\n\nThe lead.\n\n## Poses\n\n| Method |")
    assert r"| coverage | σ 0.3 m | 45 % [44 %, 46 %] | 500 draws | warns \| names the sensor |" in text
    assert "![Distribution](stability/spread.png)" in text
    assert text.index("## Poses") < text.index("## Solvers")
