"""Verifications: what their files hold, which files are refused, and what they say in words."""

import json

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.results.verification_record import (
    SCHEMA,
    VerificationRecord,
    coverage_text,
    load_verification,
    pose_text,
)
from seip_addon.core.storage.json_dataclass import as_json
from tests.builders.verification_folder import CHANGES, STEPS, make_pose

POSE = make_pose("S1", "type1", (1.0, 2.0, 5.0))
RECORD = VerificationRecord(
    "site", "july", (POSE, make_pose("S2", "type1", (9.0, 2.0, 5.0), gain=None)), CHANGES, STEPS
)


def written(path, **changes):
    content = {"schema": SCHEMA, **as_json(RECORD)} | changes
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_a_file_gives_what_was_written(tmp_path):
    assert load_verification(written(tmp_path / "v.json", versions={"seip": "1"})) == RECORD


def test_a_file_of_another_version_is_refused(tmp_path):
    with pytest.raises(SeipError, match="has the schema 'seip-verification/9'"):
        load_verification(written(tmp_path / "v.json", schema="seip-verification/9"))


def test_the_pose_is_in_words_with_its_interval():
    assert pose_text(POSE) == (
        "S1 is 0.36 m from its planned position: 0.30 m east and 0.20 m south, each within 2 mm with 95% confidence. "
        "It is turned 1.5° clockwise as seen from above and tilted 2.0° to the west, within 0.02°."
    )
    upright = make_pose("S1", "type1", (0.0, 0.0, 5.0), shift=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0))
    assert "It points as planned" in pose_text(upright)
    assert "m from its planned position, each within" in pose_text(upright)


def test_effects_add_up_to_the_difference():
    assert coverage_text(STEPS) == (
        "The installation sees 51.0% of the road; 62.0% were promised. In percentage points: poses of the sensors "
        "−2.0, changed objects +0.5, gain −9.5."
    )
