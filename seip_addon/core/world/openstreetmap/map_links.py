"""Positions in texts that users paste: coordinates, and links of web maps."""

import re
from urllib.parse import unquote

from ...base.errors import SeipError
from ...storage.xml_stream import quoted
from .extract import MAX_LATITUDE

_NUMBER = r"([+-]?[0-9]+(?:\.[0-9]*)?)"
_PAIR = re.compile(rf"\s*{_NUMBER}\s*°?\s*[,;\s]\s*{_NUMBER}\s*°?\s*")
_POINT = rf"{_NUMBER}[,~\s+]+{_NUMBER}"
_LINKS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        # What was searched or marked comes before the middle of the view, which the same link may contain.
        rf"[?&]m?lat={_NUMBER}&m?l(?:on|ng)={_NUMBER}",
        rf"[?&](?:q|query|daddr|destination|coordinate)=(?:loc:)?{_POINT}\s*(?=[&#(]|$)",
        rf"!3d{_NUMBER}!4d{_NUMBER}",
        rf"/(?:place|search|dir)/+{_POINT}(?=[/?#]|$)",
        rf"[?&](?:ll|cp|center)={_POINT}(?=[&#]|$)",
        rf"/@{_POINT}",
        rf"[#?&]map=[0-9.]+/{_NUMBER}/{_NUMBER}",
        rf"^\s*geo:{_POINT}",
    )
)


def parsed_position(text: str) -> tuple[float, float]:
    """Return latitude and longitude, degrees, from coordinates or from a link of a web map.

    Links of OpenStreetMap, Google, Bing and Apple maps and geo URIs (RFC 5870) are supported.

    Raises
    ------
    SeipError
        The text contains no position.

    Examples
    --------
    >>> parsed_position("52.47391, 13.44048")
    (52.47391, 13.44048)
    >>> parsed_position("https://www.openstreetmap.org/#map=18/52.47391/13.44048")
    (52.47391, 13.44048)
    """
    link = unquote(text)
    found = _PAIR.fullmatch(text) or next(filter(None, (pattern.search(link) for pattern in _LINKS)), None)
    if found is None:
        raise SeipError(
            f"{quoted(text)} is not a position: give latitude and longitude in degrees, like 52.47391, 13.44048, or a "
            "link of OpenStreetMap, Google, Bing or Apple maps that contains them (a short link does not; open it in a "
            "browser and copy the address from there)"
        )
    latitude, longitude = float(found[1]), float(found[2])
    if abs(latitude) > MAX_LATITUDE or abs(longitude) > 180.0:
        raise SeipError(
            f"{quoted(text)} is not a position with streets: give the latitude first, up to {MAX_LATITUDE:g} degrees, "
            "then the longitude, up to 180"
        )
    return latitude, longitude
