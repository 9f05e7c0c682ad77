"""The traffic that is shipped with the scenes: whole, dense, apart, and on its road."""

from itertools import combinations
from pathlib import Path

import bpy
import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.overlaps import find_overlaps
from seip_addon.core.sensing.traffic.road_fit import fit_to_road
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.site.scene_geometry import joined
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene

SCENES = Path(__file__).resolve().parents[4] / "scenes"
RUNS = sorted(SCENES.glob("*_traffic*/run-*.npz"))
FOLDERS = sorted({path.parent for path in RUNS})
MOST_TURN = 0.5  # radians within 0.2 s; vehicles turn less


@pytest.fixture(scope="module")
def geometries():
    found = {}
    for name in ("junction", "corridor"):
        open_blend(SCENES / f"{name}.blend")
        found[name] = read_scene(bpy.context.scene).geometry
    return found


@pytest.fixture(params=RUNS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def run(request):
    return request.param


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_no_bay_and_no_paint_is_shared(folder):
    """Of two runs no parked car stands within a metre of one of the other, and paint is drawn again: few look alike."""
    runs = [Trajectories.load(path) for path in sorted(folder.glob("*.npz"))]
    for one, other in combinations(runs, 2):
        assert not {user.name for user in one.users} & {user.name for user in other.users}
        places, looks = zip(*(parked_by_hand(run) for run in (one, other)), strict=True)
        apart = np.linalg.norm(places[0][:, None] - places[1], axis=2)
        assert apart.min() > 1.0
        assert len(looks[0] & looks[1]) <= 1  # of about six, by chance


def parked_by_hand(run):
    stood = [
        (run.position[a, :2], (user.length, user.width, user.height, user.paint))
        for user, a, b in zip(run.users, run.first[:-1], run.first[1:], strict=True)
        if np.ptp(run.position[a:b, :2], axis=0).max() < 0.1 and run.time[b - 1] - run.time[a] > 39.0
    ]
    places, looks = zip(*stood, strict=True)
    assert len(places) >= 4
    return np.array(places), set(looks)


@pytest.mark.slow
def test_a_run_lies_on_its_road(run, geometries):
    geometry = geometries[run.parent.name.partition("_")[0]]
    trajectories = Trajectories.load(run)
    again = fit_to_road(trajectories, geometry)
    assert not again.warnings
    assert again.trajectories.users == trajectories.users
    moved = np.abs(again.trajectories.position - trajectories.position)
    drives = np.array([user.category != "pedestrian" for user in trajectories.users])
    assert moved[np.repeat(drives, np.diff(trajectories.first))].max() < 2e-3
    assert moved.max() < 0.15  # a kerb: on its edge a millimetre decides
    np.testing.assert_allclose(again.trajectories.pitch, trajectories.pitch, atol=2e-3)
    heights = joined((*geometry.roads, *geometry.ground))[:, :, 2]
    assert heights.min() - 1e-3 <= trajectories.position[:, 2].min()
    assert trajectories.position[:, 2].max() <= heights.max() + 1e-3


@pytest.mark.slow
def test_nobody_stands_in_another(run):
    assert not len(finish(find_overlaps(Trajectories.load(run))))


def test_a_run_is_dense_mixed_smooth_and_light(run):
    trajectories = Trajectories.load(run)
    begin, end = trajectories.span
    assert begin == 0.0
    assert end >= 39.0
    present = [len(trajectories.at(time)) for time in np.arange(begin, end, 1.0)]
    assert min(present) >= 30
    assert {"car", "van", "truck", "pedestrian"} <= {user.category for user in trajectories.users}
    within = np.delete(np.arange(len(trajectories.time) - 1), trajectories.first[1:-1] - 1)
    assert np.diff(trajectories.time)[within].max() < 0.21
    step = np.hypot(*np.diff(trajectories.position[:, :2], axis=0).T)[within]
    assert step.max() < 0.2 * 20.0  # metres: 72 km/h
    drives = np.array([user.category != "pedestrian" for user in trajectories.users])
    drives = np.repeat(drives, np.diff(trajectories.first))[:-1][within]
    assert step[~drives].max() < 0.2 * 4.0  # nobody leaps
    assert np.abs(np.diff(trajectories.yaw))[within][drives].max() < MOST_TURN
    assert run.stat().st_size < 500_000
