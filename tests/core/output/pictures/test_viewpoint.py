import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.output.pictures.viewpoint import frame

SLOPES = np.array((0.3, 0.2))


@given(st.integers(0, 10_000), st.floats(-3, 3), st.floats(0.2, 1.4))
def test_all_points_are_in_the_picture_and_some_touch_its_border(seed, azimuth, elevation):
    points = np.random.default_rng(seed).uniform(-100, 100, (30, 3))
    view = frame(points, azimuth, elevation, SLOPES)
    on_picture = view.project(points)
    assert np.all((on_picture > -1e-9) & (on_picture < 1 + 1e-9))
    assert np.isclose(on_picture, 0, atol=1e-9).any()
    assert np.isclose(on_picture, 1, atol=1e-9).any()
