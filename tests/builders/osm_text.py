"""Extracts of OpenStreetMap written by hand: places in metres about a middle, and ten kinds of junctions."""

import math
from pathlib import Path
from xml.sax.saxutils import quoteattr

METRE = 180.0 / math.pi / 6_371_000.0


class Extract:
    """An extract that grows: nodes in metres east and north of its middle."""

    def __init__(self, latitude=52.5, longitude=13.4):
        self.latitude, self.longitude = latitude, longitude
        self.lines, self._known, self._number = [], {}, 0

    def node(self, x, y, **tags):
        """Add a node, once for each place that has no tags, and return its id."""
        if not tags and (x, y) in self._known:
            return self._known[x, y]
        number = self._next()
        latitude, longitude = self.place(x, y)
        body = self._tags(tags)
        self.lines.append(f'<node id="{number}" lat="{latitude:.8f}" lon="{longitude:.8f}">{body}</node>')
        self._known[x, y] = number
        return number

    def way(self, points, **tags):
        """Add a way through points, or through ids of nodes, and return its id."""
        refs = [point if isinstance(point, int) else self.node(*point) for point in points]
        number = self._next()
        self.lines.append(
            f'<way id="{number}">{"".join(f"<nd ref={quoteattr(str(ref))}/>" for ref in refs)}{self._tags(tags)}</way>'
        )
        return number

    def area(self, points, **tags):
        """Add a closed way."""
        return self.way([*points, points[0]], **tags)

    def house(self, x, y, width, depth, **tags):
        """Add a rectangular building by its lower left corner."""
        corners = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
        return self.area(corners, **({"building": "yes", "height": "12"} | tags))

    def relation(self, members, **tags):
        """Add a relation of (kind, id, role)."""
        body = "".join(
            f"<member type={quoteattr(kind)} ref={quoteattr(str(ref))} role={quoteattr(role)}/>"
            for kind, ref, role in members
        )
        number = self._next()
        self.lines.append(f'<relation id="{number}">{body}{self._tags(tags)}</relation>')
        return number

    def place(self, x, y):
        """Return latitude and longitude of a place."""
        east = METRE / math.cos(math.radians(self.latitude))
        return self.latitude + y * METRE, self.longitude + x * east

    def text(self):
        """Return the extract as XML; as in real ones, nodes come first."""
        order = {"<no": 0, "<wa": 1, "<re": 2}
        lines = sorted(self.lines, key=lambda line: order[line[:3]])
        return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', '<osm version="0.6">', *lines, "</osm>"])

    def write(self, path):
        """Write the extract and return its path."""
        Path(path).write_text(self.text(), encoding="utf-8")
        return Path(path)

    def _next(self):
        self._number += 1
        return self._number

    @staticmethod
    def _tags(tags):
        named = {key.replace("__", ":"): str(value) for key, value in tags.items()}
        return "".join(f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in named.items())


def corner_houses(extract, near=14.0, size=24.0, **tags):
    """Add a house at each of the four corners of a crossing."""
    for x in (near, -near - size):
        for y in (near, -near - size):
            extract.house(x, y, size, size, **tags)
    return extract


def crossing(**tags):
    """Return a crossing of two plain streets with four houses and lamps."""
    extract = Extract()
    middle = extract.node(0, 0, highway="traffic_signals")
    usual = {"highway": "secondary", "lanes": 2} | tags
    extract.way([(-200, 0), middle, (200, 0)], name="East Road", **usual)
    extract.way([(0, -200), middle, (0, 200)], name="North Road", **usual)
    for x in (-40, 40, -70, 70):
        extract.node(x, 9, highway="street_lamp", height="8")
    return corner_houses(extract)


def roundabout():
    """Return a roundabout with four arms."""
    extract = Extract()
    ring = [(18 * math.cos(math.tau * i / 16), 18 * math.sin(math.tau * i / 16)) for i in range(16)]
    ids = [extract.node(*place) for place in ring]
    extract.way([*ids, ids[0]], highway="tertiary", junction="roundabout", name="Circus")
    for name, index, end in (
        ("East", 0, (200, 0)),
        ("North", 4, (0, 200)),
        ("West", 8, (-200, 0)),
        ("South", 12, (0, -200)),
    ):
        extract.way([ids[index], end], highway="tertiary", name=f"{name} Street")
    return corner_houses(extract, near=30.0)


def dual_carriageway(*, backward=False):
    """Return a crossing of a dual carriageway with a street; ``backward`` draws one of its ways against the traffic."""
    extract = Extract()
    south, north = extract.node(0, -8, highway="traffic_signals"), extract.node(0, 8, highway="traffic_signals")
    usual = {"highway": "primary", "oneway": "yes", "lanes": 3, "name": "Avenue"}
    extract.way([(-250, -8), south, (250, -8)], **usual)
    line = [(250, 8), north, (-250, 8)]
    extract.way(line[::-1] if backward else line, **(usual | ({"oneway": "-1"} if backward else {})))
    extract.way([(0, -200), south, north, (0, 200)], highway="residential", name="Side Street")
    return corner_houses(extract, near=24.0)


def slip_lane():
    """Return a crossing with a free right turn."""
    extract = Extract()
    middle = extract.node(0, 0, highway="traffic_signals")
    usual = {"highway": "secondary", "lanes": 2}
    extract.way([(-200, 0), middle, (45, 0), (200, 0)], name="East Road", **usual)
    extract.way([(0, -200), (0, -45), middle, (0, 200)], name="North Road", **usual)
    extract.way([(0, -45), (6, -22), (22, -6), (45, 0)], highway="secondary_link", oneway="yes")
    return corner_houses(extract, near=26.0)


def tram():
    """Return a crossing with a tram in the middle of one street."""
    extract = crossing(width=14)
    for y in (-1.6, 1.6):
        extract.way([(-200, y), (200, y)], railway="tram")
    return extract


def left_hand():
    """Return a crossing where traffic keeps to the left, at Perth."""
    extract = Extract(-31.95, 115.86)
    middle = extract.node(0, 0, highway="traffic_signals")
    extract.way([(-200, 0), middle, (200, 0)], highway="secondary", lanes=4, name="East Road")
    extract.way([(0, -200), middle, (0, 200)], highway="tertiary", name="North Road", sidewalk="left")
    return corner_houses(extract)


def cycle_tracks():
    """Return a crossing with cycle tracks along its streets, and one of its own beside them."""
    extract = crossing(cycleway__both="track", width=12)
    extract.way([(-200, 14), (200, 14)], highway="cycleway", width="2.5")
    return extract


def bridge_above():
    """Return a crossing under a road on a bridge."""
    extract = crossing()
    high = {"highway": "primary", "name": "High Road"}
    extract.way([(-300, 80), (-60, 80)], **high)
    extract.way([(-60, 80), (60, 80)], bridge="yes", layer="1", **high)
    extract.way([(60, 80), (300, 80)], **high)
    return extract


def slope():
    """Return a crossing on a slope of six per cent."""
    extract = Extract()

    def at(x, y, **tags):
        return extract.node(x, y, ele=f"{50 + 0.06 * x:.2f}", **tags)

    middle = at(0, 0, highway="traffic_signals")
    extract.way([at(-200, 0), at(-100, 0), middle, at(100, 0), at(200, 0)], highway="secondary", name="Hill Road")
    extract.way([at(0, -200), at(0, -100), middle, at(0, 100), at(0, 200)], highway="secondary", name="Contour Road")
    return corner_houses(extract)


def no_sidewalk():
    """Return a crossing out of town."""
    extract = crossing(sidewalk="no")
    extract.way([(-200, 12), (-30, 12)], natural="tree_row")
    return extract


def plaza():
    """Return a T junction at a square: a pedestrian area, trees, a canopy, a wall and a shelter."""
    extract = Extract()
    middle = extract.node(0, 0)
    extract.way([(-200, 0), middle, (200, 0)], highway="tertiary", name="Market Street")
    extract.way([middle, (0, -200)], highway="residential", name="Mill Lane")
    extract.area([(-30, 8), (30, 8), (30, 60), (-30, 60)], highway="pedestrian", area="yes", name="Market")
    for x in (-20, 0, 20):
        extract.node(x, 30, natural="tree", height="9", diameter_crown="6")
    extract.area([(-8, 40), (8, 40), (8, 50), (-8, 50)], building="roof", height="5")
    extract.way([(-30, 60), (30, 60)], barrier="wall", height="2.2")
    extract.node(12, 9, highway="bus_stop", shelter="yes")
    extract.node(-40, 7, man_made="utility_pole")
    extract.house(-80, 10, 40, 20, building__levels="4", roof__shape="gabled", roof__levels="1", height="")
    outer = extract.area([(40, 10), (80, 10), (80, 50), (40, 50)])
    inner = extract.area([(52, 22), (68, 22), (68, 38), (52, 38)])
    extract.relation(
        [("way", outer, "outer"), ("way", inner, "inner")], type="multipolygon", building="yes", height="15"
    )
    return extract


JUNCTIONS = {
    "roundabout": roundabout,
    "dual carriageway": dual_carriageway,
    "slip lane": slip_lane,
    "tram": tram,
    "left hand": left_hand,
    "cycle tracks": cycle_tracks,
    "bridge above": bridge_above,
    "slope": slope,
    "no sidewalk": no_sidewalk,
    "plaza": plaza,
}
