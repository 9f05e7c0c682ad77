"""Rings are where the beams meet the road."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.lidar.beam_windows import steps_in_arcs
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.rings import beam_rings

MODELS = load_catalogue()


def rings_of(key="type1", height=5.0, gap=2.0, axes=None):
    return beam_rings(MODELS[key], np.array((3.0, 4.0, height)), np.eye(3) if axes is None else axes, 0.0, gap)


@pytest.mark.parametrize("key", MODELS)
def test_a_level_sensor_draws_circles_of_height_over_tangent(key):
    model = MODELS[key]
    drawn = rings_of(key).rings
    radii = np.unique(np.round(np.hypot(*(drawn[:, 0, :2] - (3.0, 4.0)).T), 6))
    down = -model.elevations[model.elevations < 0]
    meets = (5.0 / np.sin(down) <= model.max_range) & (5.0 / np.sin(down) > model.min_range)
    assert radii == pytest.approx(np.unique(np.round(5.0 / np.tan(down[meets]), 6)), abs=2e-6)
    assert np.allclose(drawn[..., 2], 0.0)


def test_rings_of_a_tilted_sensor_lie_on_its_beams_and_on_the_road():
    turn = math.radians(60.0)
    axes = np.array(((math.cos(turn), 0, math.sin(turn)), (0, 1, 0), (-math.sin(turn), 0, math.cos(turn))))
    ends = rings_of(axes=axes).rings.reshape(-1, 3)
    own = (ends - (3.0, 4.0, 5.0)) @ axes
    elevation = np.arcsin(own[:, 2] / np.linalg.norm(own, axis=1))
    assert np.abs(elevation[:, None] - MODELS["type1"].elevations).min(axis=1).max() < 1e-9
    assert np.allclose(ends[:, 2], 0.0)
    assert np.median(ends[:, 0]) > 3.0


def test_rings_and_cone_end_at_the_borders_of_a_limited_field_of_view():
    model = replace(MODELS["type1"], field_of_view=math.radians(90))
    drawn = beam_rings(model, np.array((0.0, 0.0, 5.0)), np.eye(3), 0.0, 2.0)
    across = math.degrees(model.field_of_view - model.azimuth_step) / 2
    for ends in (drawn.rings.reshape(-1, 3), drawn.cone[:, 1]):
        azimuth = np.degrees(np.arctan2(ends[:, 1], ends[:, 0]))
        assert (azimuth.min(), azimuth.max()) == pytest.approx((-across, across), abs=1e-9)
    assert np.linalg.norm(np.diff(drawn.rings, axis=1), axis=-1).max() < 2.0


VIEWS = st.one_of(st.sampled_from([math.tau, math.pi, math.radians(359.9), math.radians(1)]), st.floats(0.02, math.tau))


@given(VIEWS, st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_the_steps_of_arcs_are_found_each_once(view, count, seed):
    random = np.random.default_rng(seed)
    middle, half = random.uniform(-12, 12, 40), random.choice([0.01, 0.4, 3.1, math.pi, 4.0], 40) * random.random(40)
    half[:3] = math.pi, math.pi - 1e-9, math.pi + 1e-9
    size = view / count
    arc, first, width = steps_in_arcs(middle, half, size, count, all_round=view == math.tau)
    assert (np.diff(arc) >= 0).all()
    assert (width > 0).all()
    for number in range(40):
        rows = [range(f, f + w) for f, w in zip(first[arc == number], width[arc == number], strict=True)]
        found = [step % count if view == math.tau else step for row in rows for step in row]
        away = [abs(math.remainder(step * size - middle[number], math.tau)) - half[number] for step in range(count)]
        assert len(found) == len(set(found))
        assert {step for step in range(count) if away[step] < -1e-12} <= set(found)
        assert set(found) <= {step for step in range(count) if away[step] < 1e-12}
