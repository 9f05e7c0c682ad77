"""Background of single rays: against brute force, and in situations that recordings have."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.recordings.background import (
    LEAST_HEIGHT,
    MARGIN,
    MARGIN_SHARE,
    background_of,
    learn_background,
)
from seip_addon.core.sensing.recordings.ray_grid import RayGrid
from tests.builders.street_recording import canyon_sweeps, memory_record

ROAD = 40.0
QUEUE = 25.0


def grid_of(rays):
    return RayGrid(np.array([0.0]), np.array([0.0]), rays)


def learned(*columns, seconds=30.0):
    """Return the background of rays, each with its ranges by sweep; None is no return."""
    table = np.array([[np.inf if value is None else value for value in column] for column in columns], dtype=np.float32)
    return background_of(grid_of(len(columns)), np.ascontiguousarray(table.T), seconds)


def margin(distance, spread=0.0):
    return MARGIN + MARGIN_SHARE * distance + 2 * spread


def middle_of(values):
    """Return the median, or the lower of two middle values that are far apart."""
    values = sorted(values)
    lower, upper = values[(len(values) - 1) // 2], values[len(values) // 2]
    return lower if upper - lower > MARGIN else (lower + upper) / 2


def brute_force(ranges):
    """Return usual range, spread, share of returns and agreement of one ray, in words of the rule."""
    sweeps = len(ranges)
    returns = sorted(value for value in ranges if np.isfinite(value))
    if not returns:
        return np.nan, 0.0, 0.0, np.nan
    usual = middle_of(returns)
    least = max(3, round(0.15 * sweeps))
    if len(returns) >= least:
        # in the middle of the farthest that would do as a background
        far = returns[max(len(returns) - 1 - least // 2, 0)]
        agree = [value for value in returns if abs(value - far) <= margin(far)]
        near = [value < far - margin(far) for value in ranges]
        share = np.mean(near)
        changes = sum(one != other for one, other in zip(near[1:], near[:-1], strict=True))
        if len(agree) >= least and changes < share * (1 - share) * (sweeps - 1) and far > usual + margin(usual):
            usual = far
    usual = middle_of(value for value in returns if abs(value - usual) <= margin(usual))
    spread = min(1.4826 * middle_of(abs(value - usual) for value in returns), 0.5)
    agreeing = sum(abs(value - usual) <= margin(usual, spread) for value in returns)
    stopped = sum(value < usual - margin(usual, spread) for value in returns)
    agreement = agreeing / len(returns)
    returned = (len(returns) - stopped) / max(sweeps - stopped, 1)
    if agreeing < max(min(3, sweeps), 0.15 * sweeps):
        return np.nan, 0.0, returned, agreement
    return usual, spread, returned, agreement


@given(seed=st.integers(0, 2**32 - 1), sweeps=st.integers(5, 40))
def test_each_ray_is_as_by_brute_force(seed, sweeps):
    random = np.random.default_rng(seed)
    levels = random.uniform(3, 90, (3, 60))
    choice = np.sort(random.integers(0, 3, (sweeps, 60)), axis=0)  # stretches
    mixed = random.random(60) < 0.5
    choice[:, mixed] = random.permuted(choice[:, mixed], axis=0)  # flicker
    ranges = np.take_along_axis(levels, choice, axis=0) + random.normal(0, 0.02, (sweeps, 60))
    ranges[random.random((sweeps, 60)) < random.random(60)] = np.inf
    ranges = ranges.astype(np.float32)
    found = background_of(grid_of(60), ranges, 10.0)
    for ray in range(60):
        expected = brute_force(ranges[:, ray].astype(np.float64).tolist())
        got = [part[ray] for part in (found.usual, found.spread, found.returned, found.agreement)]
        assert np.allclose(got, expected, atol=1e-4, equal_nan=True), ray


def test_behind_a_queue_that_stands_for_most_of_the_recording_is_the_road():
    random = np.random.default_rng(0)
    at = [QUEUE] * 24 + [ROAD] * 16
    found = learned(*(np.array(at[turn:] + at[:turn]) + random.normal(0, 0.02, 40) for turn in range(40)))
    assert np.abs(found.usual - ROAD).max() < 0.02
    assert found.agreement == pytest.approx(0.4)
    assert (found.returned == 1.0).all()


def test_leaves_have_a_spread_and_are_no_road_users():
    random = np.random.default_rng(2)
    columns = [random.normal(30.0, 0.25, 40) for _ in range(100)]
    found = learned(*columns)
    assert np.median(found.spread) == pytest.approx(0.25, rel=0.15)
    more = random.normal(30.0, 0.25, 100)
    points = (found.rays.directions() * more[:, None]).astype(np.float32)
    assert found.foreground(points, np.full(100, 3.0)).mean() < 0.05


def test_a_ray_that_seldom_returns_has_a_background_only_if_its_returns_agree():
    seldom = [None] * 40
    agreeing, scattered = seldom.copy(), seldom.copy()
    agreeing[3], agreeing[9], agreeing[15], agreeing[21], agreeing[30], agreeing[36] = (
        50.0 + 0.01 * n for n in range(6)
    )
    scattered[3], scattered[9], scattered[15], scattered[21] = 20.0, 30.0, 41.0, 52.0
    found = learned(agreeing, scattered, seldom)
    assert found.usual[0] == pytest.approx(50.025, abs=1e-3)
    assert found.returned[0] == pytest.approx(6 / 40)
    assert np.isnan(found.usual[1:]).all()
    assert np.isnan(found.agreement[2])
    # Without a background, points are foreground from a height on.
    points = (found.rays.directions() * 10.0).astype(np.float32)
    assert found.foreground(points, np.full(3, LEAST_HEIGHT)).tolist() == [True, True, True]
    assert found.foreground(points, np.full(3, LEAST_HEIGHT - 0.01)).tolist() == [True, False, False]


@given(distance=st.floats(2, 100), nearer=st.floats(-1, 3))
def test_foreground_is_nearer_than_the_background_by_the_margin(distance, nearer):
    found = learned([distance] * 10)
    limit = margin(distance)
    if abs(nearer - limit) < 1e-3:
        return
    point = (found.rays.directions() * (distance - nearer)).astype(np.float32)
    assert found.foreground(point, np.zeros(1)).tolist() == [nearer > limit]


def test_few_sweeps_are_refused():
    model = load_catalogue()["vlp16"]
    sweeps, _ = canyon_sweeps(model, count=4)
    with pytest.raises(SeipError, match=r"S1 has 4 sweeps: the background needs 5 or more"):
        finish(learn_background(memory_record("S1", sweeps), model))


def test_confidence_and_warnings_follow_length_and_traffic():
    quiet = learned(*([20.0] * 25 for _ in range(10)), seconds=24.0)
    assert quiet.warnings("S1") == ()
    assert quiet.confidence("S1") == (
        "S1: background from 25 sweeps over 24 s; 100% of the rays with returns have a certain range"
    )
    (short,) = learned([20.0] * 25, seconds=2.0).warnings("S1")
    assert "S1: 25 sweeps over 2 s are few" in short
    queue = [QUEUE] * 15 + [ROAD] * 10
    (busy,) = learned(*([queue] * 2 + [[20.0] * 25] * 8), seconds=24.0).warnings("S1")
    assert "the background of 20% of the rays is uncertain" in busy
    assert learned([None] * 25).uncertain == 1.0
