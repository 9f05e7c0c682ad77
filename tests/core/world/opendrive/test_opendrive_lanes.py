"""Lane surfaces of small roads against exact figures and laws that hold for every road."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.opendrive.junctions import junction_area
from tests.builders.opendrive_text import document, geometry, lane, map_lanes, read_text, road, section
from tests.oracles.random_cases import cases


def surfaces(folder, *roads, **options):
    return map_lanes(read_text(folder, document(*roads)), **options)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("maps")


def plan_area(surface):
    first, second, third = np.moveaxis(surface.triangles[:, :, :2], 1, 0)
    (ax, ay), (bx, by) = (second - first).T, (third - first).T
    return np.abs(ax * by - ay * bx).sum() / 2


def test_a_straight_lane_is_a_rectangle(folder):
    (surface,) = surfaces(folder, road(geometry(length=50.0, x=10.0, y=20.0, hdg=math.pi / 2)))
    assert (surface.road_id, surface.junction_id, surface.section) == ("1", None, 0)
    assert (surface.lane_id, surface.lane_type) == (-1, "driving")
    np.testing.assert_allclose(surface.left[[0, -1]], [[10, 20, 0], [10, 70, 0]], atol=1e-8)
    np.testing.assert_allclose(surface.right[[0, -1]], [[13.5, 20, 0], [13.5, 70, 0]], atol=1e-8)
    assert surface.polygon.symmetric_difference(shapely.box(10, 20, 13.5, 70)).area < 1e-6


@given(st.floats(-0.05, 0.05), st.floats(1.0, 60.0), st.floats(0.5, 8.0))
@cases(30)
def test_a_lane_on_an_arc_has_the_area_of_its_ring(folder, curvature, length, width):
    (surface,) = surfaces(
        folder, road(geometry(f'<arc curvature="{curvature!r}"/>', length), section(lane(-1, width))), tolerance=1e-4
    )
    # Strip to the right of an arc: length · width + ½ · curvature · length · width² (Pappus).
    expected = length * width * (1 + curvature * width / 2)
    assert surface.polygon.area == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert plan_area(surface) == pytest.approx(surface.polygon.area, rel=1e-9)


curves = st.one_of(
    st.floats(-0.1, 0.1).map(lambda curvature: f'<arc curvature="{curvature!r}"/>'),
    st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)).map(
        lambda ends: f'<spiral curvStart="{ends[0]!r}" curvEnd="{ends[1]!r}"/>'
    ),
)
widths = st.tuples(st.floats(2, 5), st.floats(-0.05, 0.05), st.floats(-2e-3, 2e-3), st.floats(-3e-5, 3e-5)).map(
    lambda abcd: '<width sOffset="0" a="{!r}" b="{!r}" c="{!r}" d="{!r}"/>'.format(*abcd)
)
rises = st.tuples(st.floats(-0.1, 0.1), st.floats(-2e-3, 2e-3), st.floats(-3e-5, 3e-5)).map(
    lambda bcd: '<elevation s="0" a="0" b="{!r}" c="{!r}" d="{!r}"/>'.format(*bcd)
)


# A lane that comes to nothing between two of the places at which the deviation is looked at.
VANISHING = '<width sOffset="0" a="2.0" b="0.03125" c="0.0" d="-1.4824546509342596e-05"/>'


@given(curves, widths, rises, st.sampled_from([0.005, 0.02, 0.1]))
@example('<arc curvature="0"/>', VANISHING, "", 0.005)
@settings(max_examples=12)
def test_chords_stay_within_the_tolerance(folder, shape, width, elevation, tolerance):
    bent = road(geometry(shape, 80.0), section(lane(-1, None, inside=width)), elevation=elevation)
    (coarse,) = surfaces(folder, bent, tolerance=tolerance)
    (fine,) = surfaces(folder, bent, tolerance=tolerance / 100)
    assert len(fine.left) >= len(coarse.left)
    for near, true in ((coarse.left, fine.left), (coarse.right, fine.right)):
        assert shapely.distance(shapely.linestrings(near[:, :2]), shapely.points(true[:, :2])).max() < 1.02 * tolerance
        for number in range(0, len(true), 7):
            assert distance_to_line(near, true[number]) < 1.02 * tolerance


def distance_to_line(line, point):
    """Distance in space from a point to a line of straight pieces."""
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.clip(((point - start) * step).sum(axis=1) / (step**2).sum(axis=1), 0, 1)
    return np.linalg.norm(start + share[:, None] * step - point, axis=1).min()


@given(st.floats(-math.pi, math.pi), st.sampled_from([0.0, 5.4e6]))
@cases(20)
def test_moving_and_turning_the_map_moves_and_turns_its_lanes(folder, turn, far):
    shape = '<spiral curvStart="0.0" curvEnd="0.03"/>'
    (here,) = surfaces(folder, road(geometry(shape, 60.0)))
    (there,) = surfaces(folder, road(geometry(shape, 60.0, x=far, y=-far, hdg=turn)))
    cosine, sine = math.cos(turn), math.sin(turn)
    moved = here.left[:, :2] @ np.array([[cosine, sine], [-sine, cosine]]) + [far, -far]
    np.testing.assert_allclose(there.left[:, :2], moved, atol=1e-8)


def test_triangles_face_up_even_where_a_lane_folds_over(folder):
    # The lane reaches 10 m to the inner side of a bend of 5 m radius.
    (surface,) = surfaces(folder, road(geometry('<arc curvature="0.2"/>', 12.0), section(lane(1, 10.0))))
    sides = np.diff(surface.triangles, axis=1)
    normals = np.cross(sides[:, 0], sides[:, 1])
    assert (normals[:, 2] > 0).all()
    assert surface.polygon.is_valid
    assert surface.polygon.area == pytest.approx(
        shapely.union_all(shapely.polygons(surface.triangles[:, :, :2])).area, rel=1e-9
    )


def test_superelevation_lifts_the_left_and_leaves_the_reference_line(folder):
    both = section(lane(1, 4.0), lane(-1, 4.0))
    tilted = road(sections=both, lateral='<superelevation s="0" a="0.1" b="0" c="0" d="0"/>', elevation=lift(7.0))
    left, right = surfaces(folder, tilted)
    np.testing.assert_allclose(left.left[:, 1:], [[4 * math.cos(0.1), 7 + 4 * math.sin(0.1)]] * len(left.left))
    np.testing.assert_allclose(left.right[:, 1:], [[0, 7]] * len(left.left), atol=1e-12)
    np.testing.assert_allclose(right.right[:, 1:], [[-4 * math.cos(0.1), 7 - 4 * math.sin(0.1)]] * len(left.left))


def lift(a, b=0.0, s=0.0):
    return f'<elevation s="{s}" a="{a}" b="{b}" c="0" d="0"/>'


def test_on_a_slope_the_road_turns_about_its_rising_line(folder):
    slope, roll = 0.2, 0.3
    tilted = road(
        sections=section(lane(1, 2.0)),
        lateral=f'<superelevation s="0" a="{roll}" b="0" c="0" d="0"/>',
        elevation=lift(0.0, slope),
    )
    (surface,) = surfaces(folder, tilted)
    across = (surface.left - surface.right) / 2.0
    ahead = np.array([1.0, 0.0, slope]) / math.hypot(1.0, slope)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1.0)
    np.testing.assert_allclose(across @ ahead, 0.0, atol=1e-12)
    np.testing.assert_allclose(across[:, 1], math.cos(roll))


def test_a_shape_is_blended_between_its_stations(folder):
    def crown(s, height):
        return (
            f'<shape s="{s}" t="-4" a="0" b="{height / 4}" c="0" d="0"/>'
            f'<shape s="{s}" t="0" a="{height}" b="{-height / 4}" c="0" d="0"/>'
        )

    lanes = section(lane(1, 4.0), lane(-1, 2.0))
    left, right = surfaces(folder, road(sections=lanes, lateral=crown(80, 0.6) + crown(20, 0.2)))
    s = left.left[:, 0]
    height = np.interp(s, [20, 80], [0.2, 0.6])
    np.testing.assert_allclose(left.left[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(left.right[:, 2], height, atol=1e-9)
    np.testing.assert_allclose(right.right[:, 2], height / 2, atol=1e-9)
    assert {20, 80} <= set(np.round(s, 6))


def test_lane_heights_lift_the_edges_and_ramp_between_records(folder):
    heights = '<height sOffset="0" inner="0.12" outer="0.15"/><height sOffset="20" inner="0" outer="0.05"/>'
    _, walk = surfaces(folder, road(sections=section(lane(-1), lane(-2, 2.0, "sidewalk", heights))))
    s = walk.left[:, 0]
    np.testing.assert_allclose(walk.left[:, 2], np.interp(s, [0, 20], [0.12, 0.0]), atol=1e-9)
    np.testing.assert_allclose(walk.right[:, 2], np.interp(s, [0, 20], [0.15, 0.05]), atol=1e-9)
    # Straight up: no gap in plan between carriageway and kerb.
    np.testing.assert_allclose(walk.left[:, 1], -3.5)


@pytest.mark.parametrize("sign", [-1, 1])
def test_borders_say_where_lanes_end(folder, sign):
    def border(a, b=0.0):
        return f'<border sOffset="0" a="{sign * a}" b="{sign * b}" c="0" d="0"/>'

    bordered = section(lane(-1, None, inside=border(3.0, 0.01)), lane(-2, None, inside=border(7.0)))
    width = '<width sOffset="0" a="{}" b="{}" c="0" d="0"/>'
    wide = section(lane(-1, None, inside=width.format(3, 0.01)), lane(-2, None, inside=width.format(4, -0.01)))
    pairs = zip(surfaces(folder, road(sections=bordered)), surfaces(folder, road(sections=wide)), strict=True)
    for by_border, by_width in pairs:
        np.testing.assert_allclose(by_border.right, by_width.right, atol=1e-12)


def test_a_jump_of_the_lane_offset_stays_where_it_is(folder):
    offset = '<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="40" a="3.5" b="0" c="0" d="0"/>'
    lanes = section(lane(1), lane(-1)) + section(lane(-1), lane(-2), s=40.0)
    found = surfaces(folder, road(sections=lanes, offset=offset))
    assert sorted({surface.section for surface in found}) == [0, 1]
    together = shapely.union_all([surface.polygon for surface in found])
    assert together.symmetric_difference(shapely.box(0, -3.5, 100, 3.5)).area < 1e-5


def test_tiny_sections_leave_no_slivers_and_no_gaps(folder):
    lanes = section(lane(-1)) + section(lane(-1), s=50.0) + section(lane(-1), s=50.00000001)
    found = surfaces(folder, road(sections=lanes))
    assert [surface.section for surface in found] == [0, 2]
    assert sum(surface.polygon.area for surface in found) == pytest.approx(350.0, abs=1e-6)


def test_the_area_of_a_junction_is_the_union_of_its_lanes(folder):
    both = section(lane(1), lane(-1))
    found = surfaces(
        folder,
        road(geometry(length=20.0, x=-10.0), both, number="1", junction="7"),
        road(geometry(length=20.0, y=-10.0, hdg=math.pi / 2), both, number="2", junction="7"),
        road(geometry(length=50.0, x=10.0), both, number="3"),
    )
    cross = shapely.union(shapely.box(-10, -3.5, 10, 3.5), shapely.box(-3.5, -10, 3.5, 10))
    assert junction_area(found, "7").symmetric_difference(cross).area < 1e-3
    assert junction_area(found, "8").is_empty


def test_a_side_that_a_one_sided_section_does_not_carry_goes_on(folder):
    one_sided = section(lane(1, 2.0), s=40.0).replace("<laneSection", '<laneSection singleSide="true"')
    found = surfaces(folder, road(sections=section(lane(1, 3.0), lane(-1, 4.0)) + one_sided))
    area = {}
    for surface in found:
        area[surface.lane_id] = area.get(surface.lane_id, 0.0) + surface.polygon.area
    assert area == pytest.approx({1: 40 * 3 + 60 * 2, -1: 100 * 4}, abs=1e-6)


def test_a_road_that_cannot_be_followed_is_named(folder):
    wild = road(number="17", elevation='<elevation s="0" a="0" b="0" c="0" d="1e8"/>')
    with pytest.raises(SeipError, match="road 17, lane section at s=0 winds too tightly"):
        surfaces(folder, wild)
