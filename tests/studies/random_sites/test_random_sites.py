import math
from itertools import combinations
from xml.etree import ElementTree as ET

from headless.studies.random_sites import command as generate_sites
from headless.studies.random_sites.demand_draw import DrawnDemand
from headless.studies.random_sites.extract_text import LATITUDE, LONGITUDE, write_extract, write_terrain
from headless.studies.random_sites.production import run_path
from headless.studies.random_sites.street_plan import MIN_ANGLES, draw_plan
from headless.studies.random_sites.varied_bodies import KINDS, draw_size

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.run_overlap import MAX_OVERLAP, overlap_of, vehicle_positions
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, Trajectories
from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types
from seip_addon.core.world.elevation.geotiff import read_geotiff
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.traffic_simulation.demand import Demand, write_routes
from tests.builders.street_network import three_ways
from tests.sumo_here import needs_sumo

PLANS = [draw_plan(np.random.default_rng([5, number])) for number in range(40)]


def east_north(longitude, latitude):
    """Metres from the middle on a sphere of the Earth's mean radius."""
    east = math.radians(longitude - LONGITUDE) * 6_371_000.0 * math.cos(math.radians(LATITUDE))
    return east, math.radians(latitude - LATITUDE) * 6_371_000.0


def test_plans_differ_and_follow_from_their_seed(tmp_path):
    again = draw_plan(np.random.default_rng([5, 3]))
    for name, plan in (("a", PLANS[3]), ("b", again), ("c", PLANS[4])):
        write_extract(tmp_path / f"{name}.osm", plan)
        write_terrain(tmp_path / f"{name}.tif", plan)
    for suffix in (".osm", ".tif"):
        a, b, c = ((tmp_path / f"{name}{suffix}").read_bytes() for name in "abc")
        assert a == b != c


@pytest.mark.parametrize("plan", PLANS[:12], ids=range(12))
def test_arms_keep_their_distance_and_things_keep_off_the_streets(plan):
    headings = [math.degrees(arm.angle) for arm in plan.arms]
    apart = [abs(math.remainder(one - other, 360.0)) for one, other in combinations(headings, 2)]
    assert min(apart) >= MIN_ANGLES[len(plan.arms)] - 1e-6
    corridors = [shapely.LineString(arm.line).buffer(arm.half_width - 0.05) for arm in plan.arms]
    houses = [shapely.Polygon(thing.corners) for thing in plan.things if "building" in thing.tags]
    assert all(house.is_valid and house.area > 40.0 for house in houses)
    assert not any(one.intersects(other) for one, other in combinations(houses, 2))
    for thing in plan.things:
        shape = shapely.Polygon(thing.corners) if thing.closed else shapely.MultiPoint(thing.corners)
        assert not any(shape.intersects(corridor) for corridor in corridors)
        if not thing.closed:
            assert not any(shape.intersects(house) for house in houses)


@pytest.mark.parametrize("plan", PLANS[:12], ids=range(12))
def test_arms_have_their_slopes_and_the_middle_is_level(plan):
    assert np.abs(plan.height(np.random.default_rng(0).uniform(-10, 10, (50, 2)))).max() == 0.0
    for arm in plan.arms:
        far = arm.line[-1] / np.hypot(*arm.line[-1])
        low, high = plan.height(np.array([60.0 * far, 130.0 * far]))
        assert (high - low) / 70.0 == pytest.approx(arm.slope, abs=1e-9)


def test_terrain_and_extract_are_read_back_where_they_were_meant(tmp_path):
    plan = max(PLANS, key=lambda plan: max(abs(arm.slope) for arm in plan.arms))
    write_extract(tmp_path / "a.osm", plan)
    write_terrain(tmp_path / "a.tif", plan)
    model = read_geotiff(tmp_path / "a.tif")
    places = np.random.default_rng(1).uniform(-250.0, 250.0, (200, 2))
    degrees = np.array([(LONGITUDE, LATITUDE)]) + np.degrees(
        places / 6_371_000.0 / np.array([math.cos(math.radians(LATITUDE)), 1.0])
    )
    np.testing.assert_allclose(model.at(degrees), plan.height(places), atol=0.02)
    extract = finish(read_extract(tmp_path / "a.osm"))
    trees = [east_north(node.longitude, node.latitude) for node in extract.nodes.values() if "natural" in node.tags]
    wanted = [thing.corners[0] for thing in plan.things if thing.tags.get("natural") == "tree"]
    np.testing.assert_allclose(trees, wanted, atol=0.01)


@needs_sumo
@pytest.mark.slow
def test_a_site_is_made_kept_and_made_again(tmp_path, capsys):
    arguments = ["--sites", "1", "--seed", "3", "--runs", "2", "--duration", "10"]
    for name in ("one", "other"):
        generate_sites.main(["-o", str(tmp_path / name), *arguments])
    one, other = (tmp_path / name / "site-0001" for name in ("one", "other"))
    for path in sorted(one.rglob("*")):
        if path.is_file() and path.suffix != ".blend":
            assert path.read_bytes() == (other / path.relative_to(one)).read_bytes(), path.name
    runs = [Trajectories.load(run_path(one, number)) for number in (1, 2)]
    users = [user for run in runs for user in run.users]
    assert len({user.shape for user in users}) == len(users)
    assert len({user.length for user in users if user.category == "car"}) > 5
    positions = [vehicle_positions(f"{n}", run) for n, run in enumerate(runs)]
    assert overlap_of(*positions) < MAX_OVERLAP
    before = (one / "site.blend").stat().st_mtime_ns
    capsys.readouterr()
    generate_sites.main(["-o", str(tmp_path / "one"), *arguments])
    assert capsys.readouterr().out.endswith("site-0001: kept\n")
    assert (one / "site.blend").stat().st_mtime_ns == before
    run_path(one, 2).unlink()
    generate_sites.main(["-o", str(tmp_path / "one"), *arguments])
    assert run_path(one, 2).read_bytes() == run_path(other, 2).read_bytes()


@pytest.mark.parametrize("category", CATEGORIES)
def test_means_and_spreads_are_those_of_the_table(category):
    random = np.random.default_rng(3)
    found = np.array([draw_size(category, random) for _ in range(3000)])
    kinds = list(KINDS[category].values())
    assert sum(kind.share for kind in kinds) == pytest.approx(1.0)
    shares = np.array([kind.share for kind in kinds])
    rows = np.array([(kind.length, kind.width, kind.height) for kind in kinds])
    mean = shares @ rows[..., 0]
    cut = 0.85  # a standard deviation of normal values within two of them is 0.88, of three that all are, less
    spread = np.sqrt(shares @ (rows[..., 0] ** 2 + (cut * rows[..., 1]) ** 2) - mean**2)
    assert found.mean(axis=0) == pytest.approx(mean, abs=4 * spread.max() / np.sqrt(len(found)))
    assert found.std(axis=0) == pytest.approx(spread, rel=0.08)
    low, high = (rows[..., 0] + 2 * sign * rows[..., 1] for sign in (-1, 1))
    assert (found >= low.min(axis=0) - 0.006).all()
    assert (found <= high.max(axis=0) + 0.006).all()


def routes(folder, demand):
    path = folder / "r.rou.xml"
    write_routes(path, three_ways(folder), demand, seed=1, duration=3600.0)
    return ET.parse(path).getroot(), path.read_bytes()  # noqa: S314  # written just now


def test_own_sizes_are_drawn_for_each_road_user(tmp_path):
    root, text = routes(tmp_path, DrawnDemand(flow=1500.0))
    types = finish(read_vehicle_types([tmp_path / "r.rou.xml"]))
    moving = [entry for entry in root if entry.tag in ("vehicle", "person")]
    assert all(entry.get("type") == entry.get("id") for entry in moving)
    for entry in moving:
        category, own = entry.get("id").partition("-")[0], types[entry.get("id")]
        assert own.category in ({"car", "van"} if category == "parked" else {category})
        assert category != "parked" or own.length <= 6.0
    cars = [types[entry.get("id")] for entry in moving if entry.get("id").startswith("car")]
    assert len({(car.length, car.width, car.height) for car in cars}) > 0.9 * len(cars) > 50
    assert all(3.6 <= car.length <= 5.2 for car in cars)
    assert text == routes(tmp_path, DrawnDemand(flow=1500.0))[1]
    _, plain = routes(tmp_path, Demand(flow=1500.0))
    drives = [line.partition('depart="')[2] for line in plain.decode().splitlines() if "<vehicle " in line]
    assert drives == [line.partition('depart="')[2] for line in text.decode().splitlines() if "<vehicle " in line]
