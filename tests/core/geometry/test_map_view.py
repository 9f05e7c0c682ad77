"""View of a map in a window: pixels and metres, zoom about the mouse, and what is under it."""

import numpy as np
import pytest

from seip_addon.core.geometry.map_view import MAX_SCALE, MapView

FRAME = (100.0, 50.0, 900.0, 650.0)


@pytest.fixture
def points():
    return np.random.default_rng(3).uniform((-700.0, 200.0), (500.0, 900.0), (40, 2))


def test_all_points_are_in_the_frame_of_the_fitted_view_and_nearly_fill_it(points):
    pixels = MapView.fitted(points, FRAME).to_pixels(points)
    left, bottom, right, top = FRAME
    assert np.all((pixels >= (left, bottom)) & (pixels <= (right, top)))
    shares = np.ptp(pixels, axis=0) / (right - left, top - bottom)
    assert shares.max() == pytest.approx(0.92)
    assert (pixels.min(axis=0) + pixels.max(axis=0)) / 2 == pytest.approx(((left + right) / 2, (bottom + top) / 2))


@pytest.mark.parametrize("factor", [1.25, 1e9, 1e-9])
def test_the_place_under_the_mouse_stays_there_as_the_view_is_zoomed(points, factor):
    view, mouse = MapView.fitted(points, FRAME), (321.0, 456.0)
    zoomed = view.zoomed(factor, mouse)
    assert zoomed.to_metres(mouse) == pytest.approx(view.to_metres(mouse))
    expected = {1e9: MAX_SCALE, 1e-9: view.scale / 2}.get(factor, view.scale * factor)
    assert zoomed.scale == pytest.approx(expected)
