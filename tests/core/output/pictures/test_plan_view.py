import math
from dataclasses import replace
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import Rectangle, Wedge

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.returns_summary import ReturnsSummary
from seip_addon.core.output.pictures.drawing import (
    heading_of,
    markers_of,
    percent,
    summary,
    summary_parts,
    text_width,
    wrapped,
)
from seip_addon.core.output.pictures.palette import SEEN_COLOURS
from seip_addon.core.output.pictures.plan_style import OTHER_ROAD
from seip_addon.core.output.pictures.plan_view import INSET_SIDE, MAP_WIDTH, draw_plan, save_plan_view
from seip_addon.core.site.scene_geometry import ASSUMED, OTHER_LEVELS, Mesh, NamedArea, Pole
from tests.builders.small_junction import make_example
from tests.few import few


@pytest.fixture(scope="module")
def example():
    return make_example()


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


def test_buildings_are_darker_the_higher_they_are(example):
    figure = draw_plan(example.geometry, example.site, example.deployment)
    low, high = pixel_at(figure, (-20, 38)), pixel_at(figure, (38, 28))  # 9 m and 24 m
    assert high.mean() < low.mean() - 0.1


@pytest.mark.slow
def test_the_same_placement_gives_the_same_bytes_whatever_the_users_style(example, tmp_path):
    save_plan_view(tmp_path / "a.png", example.geometry, example.site, example.deployment)
    save_plan_view(tmp_path / "b.png", example.geometry, example.site, example.deployment)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert b"Software" not in (tmp_path / "a.png").read_bytes()[:200]
    assert imread(tmp_path / "a.png").shape[1] > 1500


def test_no_global_state_of_matplotlib_is_touched(example, tmp_path):
    before = dict(mpl.rcParams)
    save_plan_view(tmp_path / "a.png", example.geometry, example.site, example.deployment)
    assert dict(mpl.rcParams) == before


def test_labels_of_sensors_do_not_touch_each_other(example):
    figure = draw_plan(example.geometry, example.site, example.deployment)
    figure.canvas.draw()
    labels = [text.get_window_extent() for text in figure.axes[0].texts if " · " in text.get_text()]
    assert len(labels) == 3
    assert not any(a.overlaps(b) for i, a in enumerate(labels) for b in labels[:i])


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 1, 16, 45])
def test_any_number_of_sensors_can_be_drawn(example, tmp_path, count):
    chosen = np.arange(0, 2 * count, 2)
    deployment = deploy(example.site, example.models, example.visible[chosen], chosen)
    save_plan_view(tmp_path / "plan.png", example.geometry, example.site, deployment)
    figure = draw_plan(example.geometry, example.site, deployment)
    panel = figure.axes[-1]
    assert all(panel.get_ylim()[1] <= text.get_position()[1] <= panel.get_ylim()[0] for text in panel.texts)


LAST_NOTE = "This last note has to be read to its end."


@pytest.mark.parametrize("count", few([24, 3, 45], 1))
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


@pytest.mark.parametrize("radius", [10, 20, 80, 300])
def test_type_keeps_its_size_and_no_text_of_the_legend_touches_another(example, radius):
    """A page of A4 shows the type of a plan at 0.7 of its size: 9 points are 6.3 in print."""
    site = replace(example.site, region=shapely.Point(0, 0).buffer(radius))
    figure = draw_plan(example.geometry, site, example.deployment, created="2026-11-24T14:51:28+00:00")
    figure.canvas.draw()
    assert figure.get_size_inches()[0] <= MAP_WIDTH + 0.7
    assert min(text.get_fontsize() for axes in figure.axes for text in axes.texts) >= 8.5
    boxes = [text.get_window_extent() for text in figure.axes[-1].texts if text.get_text()]
    assert not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])


def test_sensors_outside_the_region_are_on_the_map(example):
    site = replace(example.site, region=shapely.box(-3, -3, 3, 3))
    plan = draw_plan(example.geometry, site, example.deployment).axes[0]
    (left, right), (bottom, top) = plan.get_xlim(), plan.get_ylim()
    for sensor in example.deployment.sensors:
        assert left < sensor.xyz[0] < right
        assert bottom < sensor.xyz[1] < top


def test_close_sensors_have_an_inset_which_hides_no_sensor_and_no_label(example):
    first, second, third = example.deployment.sensors
    near = replace(second, xyz=first.xyz + np.array((1.5, 0.0, 0.0)))
    site = replace(example.site, region=shapely.box(-150, -150, 150, 150))
    deployment = replace(example.deployment, sensors=(first, near, third))
    figure = draw_plan(example.geometry, site, deployment)
    figure.canvas.draw()
    plan, inset, _ = figure.axes
    box = inset.get_window_extent()
    assert box.width == pytest.approx(INSET_SIDE * figure.dpi)
    assert [text.get_text() for text in inset.texts if text.get_text().startswith("S")] == ["S1", "S2"]
    marks = plan.transData.transform(np.array([sensor.xyz[:2] for sensor in deployment.sensors]))
    assert not any(box.contains(*mark) for mark in marks)
    labels = [text.get_window_extent() for text in plan.texts if text.get_text()[:1] == "S" and text.get_bbox_patch()]
    assert len(labels) == 3
    assert not any(box.overlaps(label) for label in labels)
    scale = np.ptp(plan.get_xlim()) / MAP_WIDTH / (np.ptp(inset.get_xlim()) / INSET_SIDE)
    assert scale > 2
    assert len(draw_plan(example.geometry, site, example.deployment).axes) == 2


def test_streets_are_named_where_they_fit_and_crossings_are_not(example):
    places = (
        NamedArea("Mill Lane", shapely.box(-55, -7, -7, 7)),
        NamedArea("A street with a name that is far too long for it", shapely.box(7, -7, 15, 7)),
        NamedArea("Crossing of Mill Lane", shapely.box(-12, -7, -8, 7), crossing=True),
        NamedArea("南京東路", shapely.box(7, -7, 55, 7)),  # the type would draw boxes
    )
    plan = draw_plan(replace(example.geometry, places=places), example.site, example.deployment).axes[0]
    names = {place.name for place in places}
    assert [text.get_text() for text in plan.texts if text.get_text() in names] == ["Mill Lane"]


def test_the_plan_carries_the_date_of_the_placement(example):
    plan = draw_plan(example.geometry, example.site, example.deployment, created="2026-11-24T14:51:28+00:00").axes[0]
    assert "Placement of 2026-11-24" in [text.get_text() for text in plan.texts]


@pytest.mark.parametrize("size", [(600, 40), (100, 100), (40, 600)])
def test_a_metre_is_as_long_across_as_upwards_and_the_whole_region_is_shown(example, size):
    region = shapely.box(0, 0, *size)
    site = type(example.site)(**{**vars(example.site), "region": region})
    plan = draw_plan(example.geometry, site, example.deployment).axes[0]
    box = plan.get_window_extent()
    (left, right), (bottom, top) = plan.get_xlim(), plan.get_ylim()
    assert box.width / (right - left) == pytest.approx(box.height / (top - bottom))
    assert shapely.box(left, bottom, right, top).contains(region)


@pytest.mark.parametrize("corners", [((0, 0), (100, 80)), ((0, 0), (100, 20)), ((0, 30), (45, 100))])
def test_neither_scale_nor_north_arrow_hides_the_region(example, corners):
    (left, bottom), (right, top) = corners
    region = shapely.LineString([(left, bottom), (right, top)]).buffer(4.0, cap_style="flat")
    site = type(example.site)(**{**vars(example.site), "region": region})
    plan = draw_plan(example.geometry, site, example.deployment).axes[0]
    papers = [patch for patch in plan.patches if isinstance(patch, Rectangle) and patch.get_alpha() == 0.9]
    assert len(papers) == 2
    for paper in papers:
        assert not region.intersects(shapely.box(*paper.get_bbox().extents))


def test_the_legend_gives_the_weight_of_an_area_whether_or_not_it_counted(example):
    figure = draw_plan(example.geometry, example.site, example.deployment)
    assert "central box (weight 2 if weights are used)" in " ".join(text.get_text() for text in figure.axes[-1].texts)


def test_names_are_taken_as_they_are(example, tmp_path):
    site = type(example.site)(**{**vars(example.site), "name": "Corner of $1 and $2_x"})
    save_plan_view(tmp_path / "plan.png", example.geometry, site, example.deployment)


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


def test_each_type_has_its_marker(example):
    types = {sensor.model.key for sensor in example.deployment.sensors}
    markers = markers_of(example.deployment)
    assert set(markers) == types
    assert len(set(markers.values())) == len(types)


def test_only_all_is_a_hundred_per_cent_and_only_nothing_none():
    shares = (0.0, 0.0001, 0.5, 0.9999, 1.0)
    assert [percent(share) for share in shares] == ["0.0%", "<0.1%", "50.0%", "99.9%", "100.0%"]


def test_the_summary_says_what_was_placed(example):
    words = summary(example.deployment)
    assert words.startswith("3 sensors see ")
    assert f"${sum(sensor.model.price for sensor in example.deployment.sensors):,.0f}" in words


def test_the_summary_and_the_plan_name_installed_prices(example):
    assert "installed" not in summary(example.deployment)
    paid = tuple(replace(sensor, installation=9_000.0) for sensor in example.deployment.sensors)
    deployment = replace(example.deployment, sensors=paid, price=sum(sensor.price for sensor in paid))
    assert f"${deployment.price:,.0f} installed" in summary(deployment)
    assert summary(example.deployment).endswith(" for sensors")
    words = [text.get_text() for text in draw_plan(example.geometry, example.site, deployment).texts]
    assert any("installed" in text for text in words)


def test_the_legend_counts_one_post_as_one(example):
    candidates = example.site.candidates
    (first, *others), words = np.flatnonzero(~candidates.on_pole), []
    for kept in ([first], [first, others[0]]):
        on_pole = np.ones(len(candidates.position), dtype=bool)
        on_pole[kept] = False
        site = replace(example.site, candidates=replace(candidates, on_pole=on_pole))
        figure = draw_plan(example.geometry, site, example.deployment)
        words.append({text.get_text() for text in figure.axes[-1].texts})
    assert "1 possible new post" in words[0]
    assert "2 possible new posts" in words[1]


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


def test_the_map_carries_the_credits_of_its_sources(example):
    sources = ("© OpenStreetMap contributors (ODbL)", "Surveyors $& Sons")
    credited, plain = (
        [text.get_text() for text in draw_plan(example.geometry, site, example.deployment).axes[0].texts]
        for site in (replace(example.site, attribution=sources), example.site)
    )
    assert "\n".join(sources) in credited
    assert not any("OpenStreetMap" in text for text in plain)


@pytest.mark.parametrize("length", [10, 90, 400])
def test_the_title_is_whole_and_ends_on_the_page(example, length):
    name = "Saint-Symphorien-de-Lay / " * (length // 26) + "Long Street"
    figure = Figure((6.0, 8.0), dpi=100)
    FigureCanvasAgg(figure)
    heading = heading_of(replace(example.site, name=name), example.deployment, 5.4)
    heading.draw(figure, 0.3)
    boxes = [text.get_window_extent() for text in figure.texts]
    assert all(28.0 <= box.x0 < box.x1 <= 572 for box in boxes)
    assert all(one.y0 >= other.y1 - 2.0 for one, other in pairwise(boxes))
    assert boxes[-1].y0 >= 100 * (8.0 - heading.height)
    assert " ".join(text.get_text() for text in figure.texts[: len(heading.name)]) == name


@pytest.mark.parametrize("width", [0.3, 1.0, 2.5])
@pytest.mark.parametrize(
    "words", ["Karl-Marx-Straße / Thomasstraße, west arm", "Donaudampfschifffahrtsgesellschaft", "路口 一二"]
)
def test_wrapped_lines_fit_and_keep_every_letter(words, width):
    lines = wrapped(words, width, 10.0)
    assert "".join(lines).replace(" ", "") == words.replace(" ", "")
    assert all(len(line) == 1 or text_width(line, 10.0) <= width for line in lines)


def test_widths_of_texts_are_those_that_figures_draw(example):
    figure = Figure((6.0, 4.0), dpi=200)
    FigureCanvasAgg(figure)
    for size, weight in ((9.0, "normal"), (18.0, "bold"), (9.0, "normal")):
        text = figure.text(0.1, 0.5, "Four-arm signalised junction", size=size, weight=weight)
        drawn = text.get_window_extent().width / figure.dpi
        assert text_width(text.get_text(), size, weight) == pytest.approx(drawn, rel=0.02)


def test_roads_of_other_levels_are_drawn_in_a_colour_of_their_own(example):
    corners = np.array([[-60, -34, -5], [60, -34, -5], [60, -26, -5], [-60, -26, -5]], dtype=float)
    road = Mesh(f"{OTHER_LEVELS}.001", corners[[[0, 1, 2], [0, 2, 3]]])
    geometry = replace(example.geometry, ground=(*example.geometry.ground, road))
    plain, drawn = (draw_plan(one, example.site, example.deployment) for one in (example.geometry, geometry))
    place = (13.0, -31.5)
    assert np.abs(pixel_at(drawn, place) - to_rgb(OTHER_ROAD["facecolor"])).max() < 0.01
    assert np.abs(pixel_at(plain, place) - pixel_at(drawn, place)).max() > 0.05
    words = [[text.get_text() for text in figure.axes[-1].texts] for figure in (plain, drawn)]
    assert ["road on another level" in each for each in words] == [False, True]


def test_the_summary_of_a_placement_by_returns_begins_with_them_and_fits_the_page(example):
    returns = ReturnsSummary(98765.0, dict.fromkeys(("car", "cyclist", "pedestrian"), 98765.0), ())
    deployment = replace(example.deployment, returns=returns)
    assert summary(deployment).startswith("98,765 returns from a car, ")
    heading = heading_of(example.site, deployment, 5.4)
    for part in summary_parts(deployment):
        assert part in " ".join(heading.result)
    assert all(text_width(line, 12.0) <= 5.4 for line in heading.result)
