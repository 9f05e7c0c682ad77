import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from matplotlib.colors import to_rgb
from matplotlib.patches import Wedge

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.output.pictures.palette import SEEN_COLOURS
from seip_addon.core.output.pictures.plan_view import draw_plan
from seip_addon.core.site.scene_geometry import ASSUMED, Mesh, Pole


def pixel_at(figure, xy):
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())
    column, row = figure.axes[0].transData.transform(xy)
    return pixels[pixels.shape[0] - 1 - int(row), int(column), :3] / 255


@pytest.mark.parametrize("below_a_bridge", [False, True])
def test_every_target_is_painted_by_how_many_sensors_see_it(example, below_a_bridge):
    """Where no marker, label or line lies on it, the picture has the class's colour at the target."""
    deck = Mesh("Deck", np.array([[(-200, -60, 6), (200, -60, 6), (0, 250, 6)]], dtype=np.float64))
    occluders = (*example.geometry.occluders, *([deck] if below_a_bridge else []))
    figure = draw_plan(replace(example.geometry, occluders=occluders), example.site, example.deployment)
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[::-1, :, :3] / 255
    where = figure.axes[0].transData.transform(example.site.targets.xyz[:, :2]).astype(int)
    painted = pixels[where[:, 1], where[:, 0]]
    wanted = np.array([to_rgb(SEEN_COLOURS[min(n, 2)]) for n in example.deployment.seen_by])
    right = np.abs(painted - wanted).max(axis=1) < 0.02
    assert right.mean() > 0.93
    assert len(set(np.minimum(example.deployment.seen_by, 2))) == 3


LAST_NOTE = "This last note has to be read to its end."


@pytest.mark.parametrize("count", [24])
def test_all_sensors_are_listed_and_labelled_and_nothing_is_cut_off(example, count):
    site = replace(example.site, region=shapely.box(-300, -20, 300, 20))
    deployment = deploy(site, example.models, example.visible[:count], np.arange(count))
    notes = [f"Note {number}: " + 30 * "words " for number in range(8)] + [LAST_NOTE]
    figure = draw_plan(example.geometry, site, deployment, notes, created="2026-11-24T14:51:28+00:00")
    figure.canvas.draw()
    legend = figure.axes[-1].texts
    words = [text.get_text() for text in legend]
    labels = [f"S{number}" for number in range(1, count + 1)]
    assert [one for one in words if one[:1] == "S" and one[1:].isdigit()] == labels
    assert {text.get_text().split()[0] for text in figure.axes[0].texts if text.get_text()} >= set(labels)
    assert LAST_NOTE in " ".join(words)
    page = figure.bbox
    boxes = [text.get_window_extent() for text in (*legend, *figure.texts)]
    assert all(page.x0 <= box.x0 and box.x1 <= page.x1 and page.y0 <= box.y0 and box.y1 <= page.y1 for box in boxes)
    assert not any("…" in one for one in words)


def test_close_sensors_have_labels_that_touch_no_other(example):
    first, second, third = example.deployment.sensors
    near = replace(second, xyz=first.xyz + np.array((1.5, 0.0, 0.0)))
    figure = draw_plan(example.geometry, example.site, replace(example.deployment, sensors=(first, near, third)))
    figure.canvas.draw()
    plan = figure.axes[0]
    boxes = [text.get_window_extent() for text in plan.texts if text.get_text()[:1] == "S" and text.get_bbox_patch()]
    assert len(boxes) == 3
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


@pytest.mark.parametrize("size", [(600, 40)])
def test_a_metre_is_as_long_across_as_upwards_and_the_whole_region_is_shown(example, size):
    region = shapely.box(0, 0, *size)
    site = type(example.site)(**{**vars(example.site), "region": region})
    plan = draw_plan(example.geometry, site, example.deployment).axes[0]
    box = plan.get_window_extent()
    (left, right), (bottom, top) = plan.get_xlim(), plan.get_ylim()
    assert box.width / (right - left) == pytest.approx(box.height / (top - bottom))
    assert shapely.box(left, bottom, right, top).contains(region)


def test_tilted_sensors_alone_show_where_they_look(example):
    first, *others = example.deployment.sensors
    tilted = replace(first, tilt=math.radians(15), yaw=math.radians(90))
    figure = draw_plan(example.geometry, example.site, replace(example.deployment, sensors=(tilted, *others)))
    (arrow,) = (text for text in figure.axes[0].texts if getattr(text, "arrow_patch", None))
    assert arrow.xy[0] == pytest.approx(tilted.xyz[0])
    assert arrow.xy[1] > tilted.xyz[1]
    words = [text.get_text() for text in figure.axes[-1].texts]
    assert sum("tilted 15°" in text for text in words) == 1
    upright = draw_plan(example.geometry, example.site, example.deployment)
    assert not any(getattr(text, "arrow_patch", None) for text in upright.axes[0].texts)


def test_sensors_that_do_not_look_all_round_show_which_way_they_look(example):
    first, *others = example.deployment.sensors
    one_way = replace(first, yaw=math.radians(90), model=replace(first.model, field_of_view=math.radians(100)))
    figure = draw_plan(example.geometry, example.site, replace(example.deployment, sensors=(one_way, *others)))
    (wedge,) = (patch for patch in figure.axes[0].patches if isinstance(patch, Wedge))
    assert wedge.center == pytest.approx(tuple(one_way.xyz[:2]))
    assert (wedge.theta1, wedge.theta2) == pytest.approx((40.0, 140.0))
    assert sum(getattr(text, "arrow_patch", None) is not None for text in figure.axes[0].texts) == 1
    assert sum("yaw 90°" in text.get_text() for text in figure.axes[-1].texts) == 1


def test_assumed_poles_have_a_mark_of_their_own(example):
    """Those that carry nothing are drawn as well: they are in the way, and are not to be taken for the map's."""
    pole = Pole("guess", np.array((-12.0, 9.0, 0.1)), source=ASSUMED)
    geometry = replace(example.geometry, poles=(*example.geometry.poles, pole))
    words = [text.get_text() for text in draw_plan(geometry, example.site, example.deployment).axes[-1].texts]
    assert "1 assumed pole, not used" in words
    assert any(text.endswith("poles from the map") for text in words)
    plain = draw_plan(example.geometry, example.site, example.deployment)
    assert not any("assumed" in text.get_text() for text in plain.axes[-1].texts)
    marked = pixel_at(draw_plan(geometry, example.site, example.deployment), (-12.0, 9.0))
    assert np.abs(marked - pixel_at(plain, (-12.0, 9.0))).max() > 0.05
