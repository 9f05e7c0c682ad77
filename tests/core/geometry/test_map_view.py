"""View of a map in a window: pixels and metres, zoom about the mouse, and what is under it."""

import numpy as np
import pytest

from seip_addon.core.geometry.map_view import LEAST_EXTENT, MAX_SCALE, MapView, under_mouse

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


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.array([[5.0, -3.0]])])
def test_a_view_of_one_point_or_none_shows_a_hundred_metres(points):
    view = MapView.fitted(points, FRAME)
    assert view.scale == pytest.approx(0.92 * 600.0 / LEAST_EXTENT)
    assert view.middle == ((5.0, -3.0) if len(points) else (0.0, 0.0))


def test_north_is_up_and_metres_follow_from_pixels(points):
    view = MapView.fitted(points, FRAME)
    east, north = view.to_pixels(np.array([[10.0, 0.0], [0.0, 10.0]])) - view.to_pixels(np.zeros((2, 2)))
    assert east == pytest.approx((10.0 * view.scale, 0.0))
    assert north == pytest.approx((0.0, 10.0 * view.scale))
    for point, pixel in zip(points.tolist(), view.to_pixels(points).tolist(), strict=True):
        assert view.to_metres(pixel) == pytest.approx(point)


@pytest.mark.parametrize("factor", [0.7, 1.25, 1e9, 1e-9])
def test_the_place_under_the_mouse_stays_there_as_the_view_is_zoomed(points, factor):
    view, mouse = MapView.fitted(points, FRAME), (321.0, 456.0)
    zoomed = view.zoomed(factor, mouse)
    assert zoomed.to_metres(mouse) == pytest.approx(view.to_metres(mouse))
    expected = {1e9: MAX_SCALE, 1e-9: view.scale / 2}.get(factor, view.scale * factor)
    assert zoomed.scale == pytest.approx(expected)


def test_a_dragged_map_follows_the_mouse(points):
    view = MapView.fitted(points, FRAME)
    assert view.panned(30.0, -12.0).to_pixels(points) == pytest.approx(view.to_pixels(points) + np.array((30.0, -12.0)))


def test_the_middle_stays_in_the_middle_of_another_frame(points):
    view = MapView.fitted(points, FRAME).moved_to((0.0, 0.0, 200.0, 100.0))
    assert view.to_pixels(np.array([view.middle]))[0] == pytest.approx((100.0, 50.0))


def test_the_dot_whose_edge_is_nearest_to_the_mouse_is_under_it():
    pixels, radii = np.array([[0.0, 0.0], [20.0, 0.0]]), np.array([3.0, 10.0])
    assert under_mouse(pixels, radii, (2.0, 0.0), 0.0) == 0
    assert under_mouse(pixels, radii, (9.0, 0.0), 2.0) == 1
    assert under_mouse(pixels, radii, (6.5, 0.0), 3.4) is None
    assert under_mouse(pixels, radii, (6.5, 0.0), 3.5) is not None
    assert under_mouse(np.empty((0, 2)), np.empty(0), (0.0, 0.0), 99.0) is None
