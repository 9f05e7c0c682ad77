"""City models written by hand: houses with pitched roofs, in whole millimetres."""

import json
from pathlib import Path

import numpy as np

from seip_addon.core.geometry.geo_reference import projection

MILLIMETRE = 0.001


class CityModel:
    """A CityJSON file that grows; places in metres about an origin in its own system."""

    def __init__(self, origin=(0.0, 0.0, 0.0), epsg=25833, version="2.0"):
        self.origin, self.vertices = np.array(origin, dtype=float), []
        self.content = {
            "type": "CityJSON",
            "version": version,
            "transform": {"scale": [MILLIMETRE] * 3, "translate": self.origin.tolist()},
            "CityObjects": {},
            "vertices": self.vertices,
        }
        if epsg is not None:
            self.content["metadata"] = {"referenceSystem": f"https://www.opengis.net/def/crs/EPSG/0/{epsg}"}

    def ring(self, places):
        """Add places and return their indices."""
        first = len(self.vertices)
        self.vertices += [[round(value / MILLIMETRE) for value in place] for place in places]
        return list(range(first, len(self.vertices)))

    def add(self, name, *geometries, kind="Building", **more):
        """Add an object."""
        self.content["CityObjects"][name] = {"type": kind, "geometry": list(geometries)} | more
        return self

    def block(self, x, y, width, depth, height, base=0.0, lod="1.2"):
        """Return a box as a Solid."""
        low = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
        floor, top = ([(*xy, z) for xy in low] for z in (base, base + height))
        walls = [[floor[i], floor[(i + 1) % 4], top[(i + 1) % 4], top[i]] for i in range(4)]
        return self.solid([floor[::-1], top, *walls], ["GroundSurface", "RoofSurface", *["WallSurface"] * 4], lod)

    def gabled(self, x, y, width, depth, eaves, ridge, base=0.0, lod="2.2"):
        """Return a house with its ridge along x as a Solid."""
        a, b, c, d = (x, y), (x + width, y), (x + width, y + depth), (x, y + depth)
        west, east = (x, y + depth / 2, base + ridge), (x + width, y + depth / 2, base + ridge)
        f = [(*xy, base) for xy in (a, b, c, d)]
        t = [(*xy, base + eaves) for xy in (a, b, c, d)]
        faces = [
            [f[3], f[2], f[1], f[0]],
            [t[0], t[1], east, west],
            [t[2], t[3], west, east],
            [f[0], f[1], t[1], t[0]],
            [f[1], f[2], t[2], east, t[1]],
            [f[2], f[3], t[3], t[2]],
            [f[3], f[0], t[0], west, t[3]],
        ]
        return self.solid(faces, ["GroundSurface", *["RoofSurface"] * 2, *["WallSurface"] * 4], lod)

    def solid(self, faces, kinds=None, lod="2.2"):
        """Return polygons as a Solid; a face that is a list of lists has holes."""
        return {"type": "Solid", "lod": lod, "boundaries": [self.shell(faces)], **self._semantics(kinds)}

    def shell(self, faces):
        """Return polygons as lists of rings of indices."""
        return [[self.ring(ring) for ring in (face if isinstance(face[0], list) else [face])] for face in faces]

    def surfaces(self, faces, kinds=None, lod="2.2", kind="MultiSurface"):
        """Return polygons as a MultiSurface."""
        semantics = self._semantics(kinds)
        if semantics:
            semantics["semantics"]["values"] = semantics["semantics"]["values"][0]
        return {"type": kind, "lod": lod, "boundaries": self.shell(faces), **semantics}

    def write(self, path, **changed):
        """Write the model, with changes of its content, and return its path."""
        Path(path).write_text(json.dumps(self.content | changed), encoding="utf-8")
        return Path(path)

    @staticmethod
    def _semantics(kinds):
        if kinds is None:
            return {}
        names = sorted(set(kinds))
        values = [[names.index(kind) for kind in kinds]]
        return {"semantics": {"surfaces": [{"type": name} for name in names], "values": values}}


def origin_at(latitude, longitude, zone="EPSG:25833", height=30.0):
    """Return easting, northing and a height (3,) at a place, whole metres."""
    east, north = projection(zone)(np.radians(latitude), np.radians(longitude))
    return (round(east), round(north), height)
