"""What is seen between vehicles: against casting every ray at every triangle, and where the answer is plain."""

from dataclasses import replace

from headless.studies.benchmark.visibility import seen_by_tilted_full_scan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.scenarios.scenario_visibility import visibility_in_traffic
from seip_addon.core.sensing.scenarios.traffic_instants import (
    BATCH_SECONDS,
    NO_TRAFFIC,
    obstacles_of,
    spread_instants,
)
from seip_addon.core.sensing.traffic.site_traffic import check_runs
from seip_addon.core.sensing.traffic.trajectories import WARM_UP, RoadUser
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.near_surfaces import near_surfaces
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.scanning import ScanPosition
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.synthetic_junction import junction_site, make_candidates
from tests.builders.traffic_by_hand import make_model, make_trajectories, parked
from tests.engines import ANY, each_engine, needs_any
from tests.oracles.random_cases import cases

pytestmark = needs_any

DELTA = 1.5
SIZES = {
    "car": (4.5, 1.8, 1.5),
    "truck": (9.0, 2.5, 3.6),
    "bus": (12.0, 2.5, 3.1),
    "bicycle": (1.8, 0.6, 1.7),
    "pedestrian": (0.5, 0.6, 1.75),
}
MODELS = {
    "coarse": make_model(key="coarse"),
    "near-blind": make_model(
        key="near-blind", min_range=6.0, max_range=45.0, azimuth_offsets=np.linspace(-0.1, 0.1, 7)
    ),
    "one-way": make_model(key="one-way", field_of_view=np.radians(140)),
}
XYZ = np.array([[9.0, 9.0, 5.0], [-9.0, 12.0, 3.5], [0.0, -30.0, 6.0]])
SITE = replace(
    junction_site(spacing=2.0),
    candidates=make_candidates(
        np.repeat(XYZ, 3, axis=0),
        ["coarse", "near-blind", "one-way"] * 3,
        np.repeat(XYZ[:, 2], 3),
        np.array([0.0, 0.7, -2.4, 2.0, -2.0, -0.8, 3.0, -0.4, 1.6]),
        np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.15, 0.1, 0.0, 0.0]),
    ),
)
POSES = np.arange(9)
AROUND = Surroundings(SITE, MODELS, VisibilitySettings(delta=DELTA), engine=ANY)


def crowd(poses, categories):
    """The bodies of road users at (x, y, yaw)."""
    users = [RoadUser(f"{n}", category, *SIZES[category]) for n, category in enumerate(categories)]
    ways = [[(0.0, x, y, 0.0, yaw, 0.0), (10.0, x, y, 0.0, yaw, 0.0)] for x, y, yaw in poses]
    runs = make_trajectories(*ways, users=users)
    return obstacles_of(runs, runs.at(1.0))


crowds = st.lists(
    st.tuples(st.floats(-35, 35), st.floats(-7, 7), st.floats(-4, 4), st.booleans(), st.sampled_from(sorted(SIZES))),
    max_size=10,
).map(
    lambda drawn: crowd(
        [(y, x, yaw) if turned else (x, y, yaw) for x, y, yaw, turned, _ in drawn], [category for *_, category in drawn]
    )
)


def views(instants, around=AROUND):
    seen = finish(visibility_in_traffic(around, POSES, instants))
    return np.array([seen.seen(instant) for instant in range(len(instants))])


def place_of(pose, caster, around, reflectivity):
    poses = SITE.candidates
    model = around.models[str(poses.sensor[pose])]
    return ScanPosition(caster, poses.xyz[pose], float(poses.yaw[pose]), model, around.sight, reflectivity)


def by_full_scan(bodies, engine=ANY, around=AROUND):
    """Every ray at everything in one ray caster."""
    caster = make_ray_caster(np.concatenate([SITE.triangles, bodies.triangles]), engine)
    reflectivity = np.concatenate([SITE.reflectivity, bodies.reflectivity])
    surfaces = near_surfaces(caster.triangles, SITE.targets.xyz, around.sight.delta, reflectivity)
    return np.array(
        [
            seen_by_tilted_full_scan(place_of(pose, caster, around, reflectivity), tilt, surfaces)[0]
            for pose, tilt in enumerate(SITE.candidates.tilt.tolist())
        ]
    )


@pytest.mark.slow
@each_engine
@cases(15, 3)
@given(bodies=crowds)
def test_the_road_between_vehicles_is_that_of_a_full_scan(engine, bodies):
    around = replace(AROUND, engine=engine)
    assert (views([bodies], around=around)[0] == by_full_scan(bodies, engine, around)).all()


def test_the_empty_road_is_the_visibility_grid():
    grid = finish(compute_visibility(SITE, MODELS, AROUND.sight, ANY))
    assert (views([NO_TRAFFIC])[0] == grid.visible).all()


def test_a_truck_hides_the_lane_behind_it_and_shows_where_it_stands():
    pose = 0  # at (9, 9, 5)
    truck = crowd([(-4.0, 4.0, 0.0)], ["truck"])
    x, y = SITE.targets.xyz[:, 0], SITE.targets.xyz[:, 1]
    road = nobody, before = views([NO_TRAFFIC, truck])[:, pose]
    behind = (np.abs(x + 9.0) <= 2.0) & (np.abs(y - 2.0) <= 2.0)
    assert (nobody & ~before)[behind].any()
    assert (nobody == before)[x > 12.0].all()
    under = (np.abs(x + 4.0) < 4.5) & (np.abs(y - 4.0) < 1.25 + DELTA)
    assert (road[1] & ~road[0])[under].any()
    assert not (road[1] & ~road[0])[~(np.hypot(x + 4.0, y - 4.0) < 5.0 + DELTA)].any()


def test_instants_are_spread_over_all_runs_and_follow_from_the_seed():
    runs = [parked((0.0, 0.0, 0.0, 0.0, 0.0)), parked((1.0, 0.0, 0.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0, 0.0))]
    one, same, other = (spread_instants(runs, 32, seed) for seed in (3, 3, 4))
    assert one.time.tobytes() == same.time.tobytes()
    assert one.time.tobytes() != other.time.tobytes()
    assert np.bincount(one.run).tolist() == [16, 16]
    for run in (0, 1):
        part = np.floor((one.time[one.run == run] - WARM_UP) / (10.0 - WARM_UP) * 16)
        assert part.tolist() == list(range(16))
    assert len(np.unique(one.batch)) == 2 * max(1, round((10.0 - WARM_UP) / BATCH_SECONDS))
    numbers = [len(crowd.triangles) for crowd in one.obstacles()]
    assert numbers == numbers[:1] * 16 + [2 * numbers[0]] * 16


def test_traffic_that_is_of_no_use_is_refused():
    here = parked((0.0, 0.0, 0.0, 0.0, 0.0))
    check_runs([here], SITE.region)
    with pytest.raises(SeipError, match="is ever in the region of interest"):
        check_runs([here, parked((5000.0, 0.0, 0.0, 0.0, 0.0))], SITE.region)
    with pytest.raises(SeipError, match="simulate more traffic"):
        spread_instants([here, make_trajectories([(0.0, 0, 0, 0, 0, 0), (1.5, 1, 0, 0, 0, 0)])], 4, 0)
    with pytest.raises(SeipError, match="the number of instants of traffic must be at least 1"):
        spread_instants([here], 0, 0)
