"""Recordings at the shipped junction: foreground of moving road users, and poses fitted to the scene."""

import numpy as np
import pytest

pytest.importorskip("bpy")

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.recordings.background import learn_background
from seip_addon.core.sensing.recordings.recorded_frames import prepare_frames
from seip_addon.core.sensing.recordings.recording import Recording
from seip_addon.core.sensing.recordings.registration import register
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from tests.builders.junction_recording import JunctionRecording
from tests.builders.scanned_street import moved

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def junction():
    return JunctionRecording()


def test_moving_road_users_are_foreground_as_in_simulated_scans(junction):
    """The scanner knows the range behind each road user; a recording has to learn it."""
    scanned = junction.frames(junction.planned, 48, 0.8)
    records = junction.records(junction.planned, scanned, 0.8)
    poses = {
        one.label: np.vstack([np.column_stack([one.orientation, one.xyz]), [0, 0, 0, 1]]) for one in junction.planned
    }
    models = {one.label: one.model for one in junction.planned}
    frames = finish(prepare_frames(Recording("junction", tuple(records)), models, poses, radius=80.0))
    expected = found = foreground = false = 0
    for number, one in enumerate(scanned):
        marked = frames.frame(number).foreground
        static = one.instance == STATIC_INSTANCE
        moving = ~static & ~junction.parked[np.maximum(one.instance, 0)] & one.foreground
        expected, found = expected + moving.sum(), found + (moving & marked).sum()
        foreground, false = foreground + marked.sum(), false + (marked & static).sum()
    assert found / expected >= 0.9
    assert false / foreground < 0.01


def test_both_poses_are_found_in_traffic(junction):
    random = np.random.default_rng(0)
    true, shifts = zip(*(moved(one, random) for one in junction.planned), strict=True)
    records = junction.records(true, junction.frames(true, 24, 1.6), 1.6)
    for planned, record, shift in zip(junction.planned, records, shifts, strict=True):
        found = register(junction.surface, planned, finish(learn_background(record, planned.model)))
        assert np.abs(found.shift - shift)[:3].max() < 0.005
        assert np.abs(found.shift - shift)[3:].max() < 0.0003
        assert (np.abs(found.shift - shift) < 3 * found.half_width).all()
        assert found.half_width[:3].max() < 0.002
