"""Bird's-eye picture of a frame: its points, the outline of the region and their key."""

from headless.charts.birds_eye import draw_birds_eye

import numpy as np
import pytest
import shapely


def draw(region=None, points=((0.0, 0.0, 0.0), (5.0, 5.0, 0.0)), foreground=(False, True)):
    return np.asarray(
        draw_birds_eye(
            np.array(points, dtype=np.float32),
            np.array(foreground),
            (-20.0, -20.0, 20.0, 20.0),
            boxes=np.zeros((0, 7)),
            categories=[],
            sensors=np.zeros((0, 3)),
            region=region or shapely.box(-15, -15, 15, 15),
            title="site",
        )
    )


@pytest.mark.parametrize("region", [shapely.Point(0, 0).buffer(18), shapely.box(-10, -10, 10, 10)])
def test_the_region_has_an_outline(region):
    picture, scale = draw(region), (1080 - 40) / 40
    for x, y in np.asarray(region.exterior.coords)[:-1]:
        column, row = int((x + 20) * scale), int(40 + (20 - y) * scale)
        near = picture[row - 2 : row + 3, column - 2 : column + 3].reshape(-1, 3)
        assert (near == (0x8E, 0xA3, 0xB0)).all(axis=1).any()


def test_the_key_has_the_colours_of_both_kinds_of_points():
    picture = draw()
    scale = (1080 - 40) / 40
    colours = {tuple(picture[int(40 + (20 - at) * scale), int((20 + at) * scale)].tolist()) for at in (0.0, 5.0)}
    corner = {tuple(pixel) for pixel in picture[1050:1075, 600:].reshape(-1, 3).tolist()}
    assert len(colours) == 2
    assert colours <= corner
