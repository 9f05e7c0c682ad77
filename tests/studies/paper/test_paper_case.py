"""The command on the paper's case, on a map of the tests' own."""

import re
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.paper import command as paper_case

from matplotlib.image import imread

from seip_addon.core.base.errors import SeipError
from tests.sumo_here import needs_sumo

MAP = Path(__file__).resolve().parents[3] / "scenes" / "junction.xodr"


@pytest.fixture
def run(tmp_path):
    def run(*options, junction="100", source=MAP):
        folders = ["--work", str(tmp_path / "work"), "-o", str(tmp_path / "docs")]
        paper_case.main([str(source), "--junction", junction, *folders, *options])

    return run


@needs_sumo
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"junction": "965"}, r"no junction '965' in map"),
        ({"source": MAP.with_name("none.xodr")}, r"there is no file .*none.xodr: check its path"),
    ],
)
def test_files_that_do_not_fit_are_one_sentence(run, tmp_path, changes, message):
    with pytest.raises(SeipError, match=message):
        run(**changes)
    assert not (tmp_path / "docs" / "paper.md").exists()
    assert not list(tmp_path.glob("work/*traffic*/*"))


@needs_sumo
@pytest.mark.slow
def test_the_page_is_written_with_its_charts(run, tmp_path, capsys):
    brief = ["--runs", "4", "--duration", "12", "--every", "9", "--steps", "1", "--trainings", "1"]
    few = ["--approaches", "20", "--effort", "2"]
    run(*brief, *few)
    text = (tmp_path / "docs" / "paper.md").read_text(encoding="utf-8")
    assert "--steps 1 --trainings 1 --every 9" in text
    assert str(tmp_path) not in text
    assert "validation AP was still rising" in text
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == 1
    assert all(imread(tmp_path / "docs" / picture).shape[1] > 600 for picture in pictures)
    said = capsys.readouterr().out
    assert "claim 8 (" in said
    assert "undecided" in text
