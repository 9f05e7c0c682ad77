"""Flat maps on ground: roads, verges, poles and buildings stand at its height, and a bridge above it."""

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.world.openstreetmap.network_map import read_network_map
from tests.builders.dem_files import origin_at, sampled, write_dem
from tests.builders.opendrive_text import document, geometry, lane, road, section
from tests.builders.osm_text import bridge_above, crossing
from tests.sumo_here import needs_sumo

X, Y, _ = origin_at(52.5, 13.4)
UTM33 = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
LAMP = '<object id="1" type="streetLamp" name="lamp" s="120" t="6" zOffset="0" hdg="0" radius="0.1" height="8"/>'


def plane(x, y):
    return 40 + 0.03 * (x - X) - 0.05 * (y - Y)


def hill(x, y):
    return 40 + 6 * np.cos(np.hypot(x - X, y - Y) / 40)


def street(tmp_path, z=0.0):
    head = f'<header><offset x="{X}" y="{Y}" z="0" hdg="0"/><geoReference><![CDATA[{UTM33}]]></geoReference></header>'
    level = f'<elevation s="0" a="{z}" b="0" c="0" d="0"/>'
    lanes = section(lane(1), lane(-1), lane(-2, width=2.0, kind="sidewalk"))
    path = tmp_path / "street.xodr"
    body = road(geometry(length=300.0, x=-150.0), lanes, elevation=level, objects=LAMP)
    path.write_text(document(body, header=head), encoding="utf-8")
    return path


def ground(tmp_path, surface, reach=320):
    heights = sampled(surface, X - reach, Y + reach, 2 * reach)
    return write_dem(tmp_path / "dem.tif", heights, X - reach, Y + reach)


def named(model, name):
    return next(part for part in model.parts if part.name.startswith(name))


def over(part, model, surface):
    """Heights of a part's vertices over a surface of projected coordinates."""
    places = part.solid.vertices + part.foot + model.origin
    return places[:, 2] - surface(places[:, 0] + X, places[:, 1] + Y)


@pytest.mark.parametrize("z", [0.0, 34.0])
def test_everything_stands_on_a_plane(tmp_path, z):
    description = tmp_path / "site.toml"
    description.write_text(
        "[[building]]\noutline = [[-10, 20], [10, 20], [10, 30], [-10, 30]]\nheight = 9\n"
        "[[street_light]]\nposition = [20, -12]\n[[tree]]\nposition = [-20, 15]\n",
        encoding="utf-8",
    )
    asked = SiteRequest(near=(0.0, 0.0), radius=60.0, site=description, terrain=ground(tmp_path, plane))
    model = finish(build_site(street(tmp_path, z), asked)).model
    assert model.origin[2] == 40
    assert np.abs(over(named(model, "Driving lanes"), model, plane)).max() < 1e-3
    assert over(named(model, "Pavements"), model, plane) == pytest.approx(0.12, abs=1e-3)
    assert np.abs(over(named(model, "Verge"), model, plane)).max() < 0.2  # a kerb and the little that it lies below
    house = named(model, "Building 1").solid.vertices
    assert house[:, 2].min() + model.origin[2] == pytest.approx(plane(X - 10, Y + 30), abs=1e-3)
    for name, at in (("Street light", (20, -12)), ("Tree", (-20, 15)), ("lamp", (-30, 6))):
        foot = named(model, name).foot
        assert foot[:2] == pytest.approx(at, abs=1e-6)
        assert foot[2] + model.origin[2] == pytest.approx(plane(X + at[0], Y + at[1]), abs=0.02)


def test_roads_follow_hills_within_the_smoothing(tmp_path):
    """A Gaussian of 4 m takes (1 - exp(-(4/40)²/2)) of a wave of 251 m, chords of ten metres take as much again."""
    asked = SiteRequest(near=(0.0, 0.0), radius=60.0, terrain=ground(tmp_path, hill))
    model = finish(build_site(street(tmp_path), asked)).model
    assert np.abs(over(named(model, "Driving lanes"), model, hill)).max() < 6 * 0.005 * 3
    assert np.abs(over(named(model, "Verge"), model, hill)).max() < 0.25
    kerbs = over(named(model, "Kerbs"), model, hill)
    assert (kerbs.min(), kerbs.max()) == (pytest.approx(0.12 - 0.35, abs=0.1), pytest.approx(0.12, abs=0.1))
    assert any("smoothed by a Gaussian of 4 m" in note for note in model.notes)


@needs_sumo
def test_streets_of_an_extract_lie_on_the_ground(tmp_path):
    asked = SiteRequest(near_latlon=(52.5, 13.4), terrain=ground(tmp_path, plane))
    built = finish(build_site(crossing().write(tmp_path / "place.osm"), asked))
    roads = named(built.model, "Driving lanes").solid.vertices
    slope = np.linalg.lstsq(np.column_stack([roads[:, :2], np.ones(len(roads))]), roads[:, 2], rcond=None)[0]
    assert slope[:2] == pytest.approx([0.03, -0.05], abs=1e-4)
    assert built.model.origin[2] == 40
    (tmp_path / "raised.net.xml").write_text(built.map_text, encoding="utf-8")
    raised = read_network_map(tmp_path / "raised.net.xml").streets.road_map
    offset = raised.header_offset[:2]
    roads = [each.place(np.array([0.0, each.length / 3, each.length]), np.zeros(3)) for each in raised.roads]
    places = np.concatenate(roads)
    inside = np.abs(places[:, :2] - built.model.origin[:2]).max(axis=1) < 120  # of the raster; it goes on level
    assert places[inside, 2] == pytest.approx(plane(*(places[inside, :2] + offset).T), abs=0.05)  # bends
    for part in built.model.parts:
        assert np.isfinite(part.solid.vertices).all()
        if Role.POLES in part.roles:
            x, y, z = part.foot
            assert z == pytest.approx(slope @ [x, y, 1], abs=0.25)


@needs_sumo
def test_a_bridge_stays_above(tmp_path):
    asked = SiteRequest(near_latlon=(52.5, 13.4), approaches=80.0, terrain=ground(tmp_path, plane))
    model = finish(build_site(bridge_above().write(tmp_path / "place.osm"), asked)).model
    deck = over_extract(named(model, "Roads above"), model)
    assert deck.max() == pytest.approx(6.0, abs=0.6)


def over_extract(part, model):
    offset = model.header_offset[:2]
    places = part.solid.vertices + model.origin
    return places[:, 2] - plane(places[:, 0] + offset[0], places[:, 1] + offset[1])
