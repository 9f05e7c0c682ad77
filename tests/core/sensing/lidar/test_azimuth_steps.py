"""The steps in an arc are those that lie in it one by one, whatever borders it crosses."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.lidar.azimuth_steps import steps_in_arcs

VIEWS = st.one_of(st.sampled_from([math.tau, math.pi, math.radians(359.9), math.radians(1)]), st.floats(0.02, math.tau))


@given(VIEWS, st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_the_steps_of_arcs_are_found_each_once(view: float, count: int, seed: int) -> None:
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


def test_an_arc_over_both_ends_of_a_field_of_view_is_two_rows() -> None:
    """Ten steps from 0 to 288 degrees: an arc of 200 degrees about 324 holds those up to 64 and from 224 on."""
    of_one = np.array([math.radians(324)]), np.array([math.radians(100)]), math.radians(32), 10
    arc, first, width = steps_in_arcs(*of_one, all_round=False)
    assert (arc.tolist(), first.tolist(), width.tolist()) == ([0, 0], [0, 7], [3, 3])
