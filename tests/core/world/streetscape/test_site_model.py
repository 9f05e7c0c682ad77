import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.plan import signed_area
from seip_addon.core.site.roles import Role
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import Area, Building, Poles, SiteDescription, Trees
from tests.builders.map_models import HERE, model_of_street, site_model
from tests.builders.opendrive_text import document, geometry, read_text, road

MAPS = Path(os.environ.get("SEIP_MAPS") or Path(__file__).resolve().parents[5] / "shared" / "opendrive")
SIGNAL = (
    '<signal id="1" s="{s}" t="{t}" zOffset="0" orientation="{to}" dynamic="{dynamic}" type="1000001" hOffset="0"/>'
)
BOX = '<object id="{id}" type="{kind}" name="{name}" s="80" t="{t}" zOffset="0" hdg="0" {size}/>'


def part(built, name):
    return next(each for each in built.parts if each.name == name)


def with_role(built, role):
    return [each for each in built.parts if role in each.roles]


def plan(each):
    return shapely.union_all([shapely.Polygon(each.solid.vertices[list(face), :2]) for face in each.solid.faces])


def plan_sum(each):
    return sum(shapely.Polygon(each.solid.vertices[list(face), :2]).area for face in each.solid.faces)


def placed(each):
    """Return the part's corners in local axes."""
    cos, sin = math.cos(each.yaw), math.sin(each.yaw)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    return each.solid.vertices @ turn.T + each.foot


def test_the_region_is_the_driving_surface_within_the_radius(tmp_path):
    expected = shapely.box(-30, -3.5, 30, 3.5).intersection(shapely.Point(0, 0).buffer(30, quad_segs=32))
    built = model_of_street(tmp_path)
    assert built.region.symmetric_difference(expected).area < 0.05
    assert plan(part(built, "Region of interest")).symmetric_difference(expected).area < 0.05


def test_flush_pavements_are_raised_and_raised_ones_are_kept(tmp_path):
    for kerb, height in ((0.0, 0.12), (0.2, 0.2)):
        heights = part(model_of_street(tmp_path, kerb=kerb), "Pavements").solid.vertices[:, 2]
        np.testing.assert_allclose(heights, height, atol=1e-9)


def test_pavements_near_the_region_are_candidate_areas_and_others_are_not(tmp_path):
    built = model_of_street(tmp_path)
    near, verge = with_role(built, Role.CANDIDATE_AREAS)
    assert Role.GROUND in near.roles
    assert verge.name == "Verge strip"
    assert np.abs(verge.solid.vertices[:, 0]).max() < 10.1  # beside the junction alone, where no pavement is
    low, high = near.solid.vertices[:, 0].min(), near.solid.vertices[:, 0].max()
    assert -60 < low < -40
    assert 40 < high < 60
    assert part(built, "Pavements beyond").roles == (Role.GROUND,)


def test_every_kind_of_lane_has_its_surface(tmp_path):
    kinds = ("driving", "biking", "parking", "shoulder", "median", "border", "sidewalk")
    built = model_of_street(tmp_path, lane_types=kinds)
    roads = {each.name for each in with_role(built, Role.ROADS)}
    ground = {each.name for each in with_role(built, Role.GROUND)}
    assert roads == {"Driving lanes", "Cycle lanes", "Parking lanes", "Shoulders"}
    assert ground >= {"Medians", "Borders", "Pavements", "Kerbs", "Verge"}
    assert plan(part(built, "Cycle lanes")).intersects(shapely.box(-20, 3.6, -15, 5.4))


def test_ground_and_lanes_leave_no_hole(tmp_path):
    built = model_of_street(tmp_path)
    names = ("Driving lanes", "Pavements", "Pavements beyond", "Verge")
    covered = shapely.union_all([plan(part(built, name)) for name in names])
    assert covered.buffer(0.01).buffer(-0.01).contains(shapely.Point(0, 0).buffer(40))
    assert sum(plan_sum(part(built, name)) for name in names) == pytest.approx(covered.area, rel=0.01)


def test_a_grade_is_followed_by_everything(tmp_path):
    tree = Trees(np.array([[-20.0, 9.0]]), 8.0, 5.0)
    built = model_of_street(tmp_path, replace(HERE, trees=(tree,)), grade=0.05)
    assert built.origin[2] == round(0.05 * 110)
    heights = part(built, "Driving lanes").solid.vertices
    np.testing.assert_allclose(heights[:, 2] + built.origin[2], 0.05 * (heights[:, 0] + 110), atol=1e-6)
    assert part(built, "Tree 1").foot[2] + built.origin[2] == pytest.approx(0.05 * 90 + 0.12, abs=0.1)


def test_far_map_coordinates_change_nothing_but_the_origin(tmp_path):
    tree = Trees(np.array([[-20.0, 9.0]]), 8.0, 5.0)
    signal = SIGNAL.format(s=95, t=-5, to="+", dynamic="yes")
    here = model_of_street(tmp_path, replace(HERE, trees=(tree,)), signals=signal)
    x, y = 5_412_345.0, -4_987_654.0
    moved = replace(HERE, near=(x, y), trees=(replace(tree, positions=tree.positions + np.array([x, y])),))
    there = model_of_street(tmp_path, moved, x=x, y=y, signals=signal)
    np.testing.assert_array_equal(there.origin - here.origin, [x, y, 0])
    assert [each.name for each in here.parts] == [each.name for each in there.parts]
    for mine, other in zip(here.parts, there.parts, strict=True):
        assert plan_sum(mine) == pytest.approx(plan_sum(other), abs=1e-4)
        low, high = placed(mine).min(axis=0), placed(mine).max(axis=0)
        np.testing.assert_allclose(placed(other).min(axis=0), low, atol=1e-5)
        np.testing.assert_allclose(placed(other).max(axis=0), high, atol=1e-5)


def test_the_same_inputs_give_the_same_model(tmp_path):
    first, second = model_of_street(tmp_path), model_of_street(tmp_path)
    for mine, other in zip(first.parts, second.parts, strict=True):
        assert (mine.name, mine.roles, mine.foot, mine.yaw) == (other.name, other.roles, other.foot, other.yaw)
        np.testing.assert_array_equal(mine.solid.vertices, other.solid.vertices)
        assert mine.solid.faces == other.solid.faces


@pytest.mark.parametrize(("direction", "side"), [("+", -1), ("-", 1)])
def test_a_signal_beside_the_carriageway_is_its_pole_and_faces_its_traffic(tmp_path, direction, side):
    """Traffic keeps to the right, so that the pole stands at its right and the mast arm reaches left."""
    built = model_of_street(tmp_path, signals=SIGNAL.format(s=95, t=5 * side, to=direction, dynamic="yes"))
    (pole,) = with_role(built, Role.POLES)
    np.testing.assert_allclose(pole.foot, [-15, 5 * side, 0.12], atol=1e-6)
    arm_tip = placed(pole)[np.argmax(pole.solid.vertices[:, 0])]
    assert abs(arm_tip[1]) < 3
    travel = 1 if direction == "+" else -1
    assert lamp_direction(pole) @ [travel, 0, 0] == pytest.approx(-1)


def lamp_direction(pole):
    face = next(f for f, name in zip(pole.solid.faces, pole.solid.materials, strict=True) if name == "red lamp")
    a, b, c = placed(pole)[list(face[:3])]
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal)


def test_objects_of_the_map_become_what_they_are(tmp_path):
    furniture = "".join(
        BOX.format(id=i, kind=kind, name=name, t=t, size=size)
        for i, (kind, name, t, size) in enumerate(
            [
                ("building", "house", 20, 'length="12" width="10" height="9"'),
                ("tree", "lime", 8, 'height="7" radius="2"'),
                ("vegetation", "hedge", -9, 'length="12" width="1" height="1.5"'),
                ("streetLamp", "light", -6, 'height="8"'),
                ("pole", "bollard", 6, 'height="0.9" radius="0.1"'),
                ("crosswalk", "zebra", 0, 'length="4" width="7" height="4"'),
            ]
        )
    )
    built = model_of_street(tmp_path, furniture=furniture)
    house = part(built, "house")
    assert house.roles == (Role.OCCLUDERS,)
    assert plan(house).symmetric_difference(shapely.box(-36, 15, -24, 25)).area < 1e-6
    assert house.solid.vertices[:, 2].max() == pytest.approx(9)
    assert part(built, "house windows").roles == (Role.DRESSING,)
    assert placed(part(built, "lime"))[:, 2].max() == pytest.approx(7)
    assert "leaves" in part(built, "hedge").solid.materials
    assert part(built, "light").roles == (Role.POLES,)
    assert math.sin(part(built, "light").yaw) == pytest.approx(1)  # towards the road
    assert part(built, "bollard").roles == (Role.OCCLUDERS,)
    assert "zebra" not in {each.name for each in built.parts}


def test_what_the_description_adds_stands_where_it_says(tmp_path):
    description = replace(
        HERE,
        buildings=(Building(shapely.box(-5, 10, 5, 20), 12.0),),
        street_lights=(Poles(np.array([[0.0, 6.0]]), 8.0, 1.5, None),),
        signal_poles=(Poles(np.array([[12.0, -6.0]]), 6.0, 4.0, math.pi / 2),),
        forbidden_areas=(Area("Church", shapely.box(20, 3, 25, 8)),),
        mandatory_areas=(Area("School", shapely.box(-25, 3, -20, 8)),),
    )
    built = model_of_street(tmp_path, description)
    assert part(built, "Building 1").solid.vertices[:, 2].max() == pytest.approx(12.0, abs=0.2)
    light = part(built, "Street light 1")
    assert light.foot[:2] == (0.0, 6.0)
    assert math.sin(light.yaw) == pytest.approx(-1)
    assert part(built, "Church").roles == (Role.FORBIDDEN_AREAS,)
    assert part(built, "School").roles == (Role.MANDATORY_AREAS,)
    assert len(with_role(built, Role.POLES)) == 2


def test_an_area_far_larger_than_the_place_keeps_its_outline_in_few_triangles(tmp_path):
    large = shapely.box(-12_000, -12_000, 12_000, 12_000)
    built = model_of_street(tmp_path, replace(HERE, forbidden_areas=(Area("Town", large),)))
    solid = part(built, "Town").solid
    triangles = solid.vertices[np.array(solid.faces)]
    assert len(triangles) < 10_000
    assert signed_area(triangles).sum() == pytest.approx(large.area, rel=1e-6)
    assert signed_area(triangles).min() > 0.0


def test_lines_are_painted_between_lanes_but_not_in_the_junction(tmp_path):
    markings = part(model_of_street(tmp_path), "Lane markings").solid
    assert (np.abs(markings.vertices[:, 0]) > 11).all()
    assert (np.abs(markings.vertices[:, 1]) < 0.1).all()


@pytest.mark.skipif(not MAPS.is_dir(), reason="the maps of other projects are not here; set SEIP_MAPS to their folder")
@pytest.mark.parametrize(
    ("name", "place"),
    [
        pytest.param("Town05", {"near": (-49.0, -1.0)}, marks=pytest.mark.slow),
        ("Town01", {"junction": "87"}),
        ("crest-curve", {"near": (200.0, -10.0)}),
        ("parking_demo", {"junction": "100"}),
        ("stationary_objects", {"near": (20.0, 0.0), "radius": 50.0}),
    ],
)
def test_real_maps_become_one_sound_layer(name, place):
    built = finish(site_model(read_map(MAPS / f"{name}.xodr"), SiteDescription(**place)))
    assert all(np.isfinite(each.solid.vertices).all() for each in built.parts)
    assert len(with_role(built, Role.REGION)) == 1
    assert with_role(built, Role.CANDIDATE_AREAS)
    driving = part(built, "Driving lanes")
    assert plan(driving).buffer(0.06).contains(built.region)
    if name == "Town05":  # its lanes cross each other in every junction
        assert plan_sum(driving) == pytest.approx(plan(driving).area, rel=0.002)
        assert sum(len(each.solid.faces) for each in built.parts) < 20_000


def test_a_tunnel_is_named_in_a_note(tmp_path):
    text = document(road(geometry(length=200.0), objects='<tunnel id="9" name="Hill" s="20" length="80"/>'))
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(100.0, 0.0), radius=50.0)))
    assert "tunnel Hill of road 1 is built as an open road, without its walls and its roof" in model.notes


def test_the_middle_lies_on_a_road(tmp_path):
    angle = [road(geometry(length=200.0)), road(geometry(length=80.0, hdg=np.pi / 2), number="2")]
    x, y = read_text(tmp_path, document(*angle)).middle()
    assert (x, y) == pytest.approx((100.0, 0.0), abs=10.0)
    assert y == 0.0


def test_the_title_of_a_site_names_the_map_and_the_junction_that_was_asked_for(tmp_path):
    text = document(road(junction="5"), road(geometry(x=100.0), number="2"), rest='<junction id="5"/>')
    road_map = read_text(tmp_path, text)
    titles = {
        place: finish(site_model(road_map, SiteDescription(**dict(place)))).name
        for place in ((("junction", "5"),), (("near", (50.0, 0.0)),), (("junction", "5"), ("name", "Mill Lane")))
    }
    assert list(titles.values()) == ["map, junction 5", "map", "Mill Lane"]
