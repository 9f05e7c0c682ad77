import math
from itertools import combinations

from headless.studies.random_sites import command as generate_sites
from headless.studies.random_sites.extract_text import LATITUDE, LONGITUDE, write_extract, write_terrain
from headless.studies.random_sites.production import run_path
from headless.studies.random_sites.street_plan import MIN_ANGLES, draw_plan

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.run_overlap import MAX_OVERLAP, overlap_of, vehicle_positions
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.world.elevation.geotiff import read_geotiff
from seip_addon.core.world.openstreetmap.extract import read_extract
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
