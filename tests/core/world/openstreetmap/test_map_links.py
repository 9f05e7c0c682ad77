"""Positions in coordinates and links that users paste."""

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.world.openstreetmap.map_links import parsed_position

HERE = (52.47391, 13.44048)


@pytest.mark.parametrize("text", [
    "52.47391, 13.44048",
    " 52.47391 13.44048\n",
    "52.47391° 13.44048°",
    "https://www.openstreetmap.org/#map=18/52.47391/13.44048",
    "https://www.openstreetmap.org/way/123456#map=18/52.47391/13.44048&layers=N",
    "openstreetmap.org/#map=18.5/52.47391/13.44048",
    "https://www.openstreetmap.org/?mlat=52.47391&mlon=13.44048#map=12/1/2",
    "https://www.google.com/maps/@52.47391,13.44048,18z",
    "https://www.google.com/maps/@52.47391,13.44048,18z/data=!3m1!1e3?entry=ttu",
    "https://www.google.com/maps/place/Some+Place/@52.4,13.4,17z/data=!3m1!4b1!4m6!3m5!1s0x47a8!8m2!3d52.47391!4d13.44048",
    "https://www.google.com/maps/place/52.47391,13.44048/@52.4,13.4,17z",
    "https://www.google.com/maps/search/52.47391,+13.44048?entry=tts",
    "https://www.google.com/maps?q=52.47391,13.44048&z=17",
    "https://maps.google.com/?q=loc:52.47391+13.44048",
    "https://www.google.com/maps/search/?api=1&query=52.47391%2C13.44048",
    "https://www.bing.com/maps?cp=52.47391~13.44048&lvl=18&style=r",
    "https://www.bing.com/maps?lvl=18&cp=52.47391%7E13.44048",
    "https://maps.apple.com/?ll=52.47391,13.44048&q=Some%20Place&z=18",
    "https://maps.apple.com/place?coordinate=52.47391,13.44048&name=Pin",
    "geo:52.47391,13.44048",
    "geo:52.47391,13.44048,35;crs=wgs84;u=20?z=18",
    "geo:0,0?q=52.47391,13.44048(Some%20Place)",
])  # fmt: skip
def test_position_is_read_from_coordinates_and_links(text):
    assert parsed_position(text) == HERE


def test_position_may_be_south_and_west():
    assert parsed_position("-31.97, -115.86") == (-31.97, -115.86)
    assert parsed_position("https://www.openstreetmap.org/#map=18/-31.97/-115.86") == (-31.97, -115.86)
    assert parsed_position("https://www.bing.com/maps?cp=-31.97~-115.86") == (-31.97, -115.86)


@pytest.mark.parametrize("text", [
    "", "Harbour Road", "52.47391", "https://maps.app.goo.gl/a1B2c3", "https://osm.org/go/0MbEUuTq?m",
    "https://www.openstreetmap.org/?mlat=52.47391", "https://www.openstreetmap.org/way/123456", "1,2,3",
    "https://www.google.com/maps?q=52,13th+Street",
])  # fmt: skip
def test_text_without_a_position_is_refused_with_what_is_accepted(text):
    with pytest.raises(SeipError, match=r"is not a position: give latitude and longitude .*Google, Bing or Apple maps"):
        parsed_position(text)


@pytest.mark.parametrize("text", ["113.4, 52.5", "52.5, 190", "https://www.bing.com/maps?cp=89~13"])
def test_position_without_streets_is_refused(text):
    with pytest.raises(SeipError, match="is not a position with streets: give the latitude first"):
        parsed_position(text)
