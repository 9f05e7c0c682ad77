"""The section of a report on the verification of the installation."""

import json
from html import unescape

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.report.blocks import Picture, Table, as_html
from seip_addon.core.output.report.evidence import load_evidence
from seip_addon.core.output.report.pdf import as_pdf
from seip_addon.core.output.report.sections import make_report
from seip_addon.core.output.results.verification_record import coverage_text
from tests.builders.report_folder import make_folder
from tests.builders.verification_folder import make_verification

TITLE = "Verification of the installation"


@pytest.fixture
def folder(tmp_path):
    make_folder(tmp_path / "out")
    return tmp_path / "out"


def section(folder):
    return make_report(load_evidence(folder)).sections[TITLE]


def of_kind(folder, kind):
    return [block for block in section(folder) if isinstance(block, kind)]


def test_the_section_tells_poses_changes_coverage_and_gain(folder):
    record = make_verification(folder)
    page = unescape(as_html(make_report(load_evidence(folder))))
    assert as_pdf(make_report(load_evidence(folder))).startswith(b"%PDF")
    for one in record.sensors:
        assert f"{one.id} is 0.36 m from its planned position" in page
        assert f"{one.id} has a gain of 0.64" in page
    assert coverage_text(record.coverage) in page
    (changes,) = of_kind(folder, Table)
    assert [(row[0], row[1], row[3]) for row in changes.rows] == [
        ("Found 1: not in the plan", "3.0 × 1.5 × 4.0", "costs 1.2 points"),
        ("Kiosk <b>: no longer there", "4.0 × 4.0 × 3.0", "adds 0.4 points"),
        ("Found 3: not in the plan", "1.0 × 1.0 × 2.0", "no effect"),
    ]
    assert all("° N, " in row[2] for row in changes.rows)  # the map's projection is known
    assert len(of_kind(folder, Picture)) == 1
    assert "1 standing vehicle is not counted as changes." in page
    assert "Kiosk <b>" not in as_html(make_report(load_evidence(folder)))


def test_the_picture_may_be_missing(folder):
    make_verification(folder)
    (folder / "verification" / "changes.png").unlink()
    assert len(of_kind(folder, Picture)) == 0


@pytest.mark.parametrize("changed", [{"id": "S99"}, {"local_m": [0.0, 0.0, 9.0]}])
def test_the_verification_of_another_placement_is_refused(folder, changed):
    make_verification(folder)
    path = folder / "verification" / "verification.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    content["sensors"][0] |= changed
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(SeipError, match="of another placement"):
        load_evidence(folder)
