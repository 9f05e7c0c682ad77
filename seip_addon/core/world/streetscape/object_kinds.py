"""Classification of a map's objects: by type if they have one, otherwise by name and shape."""

import re
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...base.arrays import Float
from ..opendrive.objects import TUNNEL, PlacedObject

FLAT_KINDS = {TUNNEL, "crosswalk", "parkingspace", "roadmark", "roadsurface", "patch"}
UNTYPED = {"-1", "none", ""}  # types without meaning: name and shape decide
VAGUE_TYPES = UNTYPED | {"obstacle"}  # types for which name and shape are more specific
SIGNAL_WORDS = {"signal", "signals", "traffic", "trafficlight", "light", "ampel", "mast", "gantry", "signalpole"}
"""Words in the name of a post that carries traffic lights."""
SIGN_WORDS = {"sign", "signs", "schild", "verkehrszeichen", "speed"}
MIN_HEIGHT = 0.01
"""Metres: lower heights count as not given in the map."""
MIN_POST_HEIGHT, MAX_POST_THICKNESS, MIN_POST_SLENDERNESS = 2.0, 0.6, 6.0
"""Least height and greatest thickness of a post (metres), and least ratio of the two."""


class Kind(Enum):
    """Kinds of objects that are modelled."""

    FLAT = "flat"
    """Paint and surfaces without height."""
    TREE = "tree"
    PLANTS = "plants"
    """Hedges, bushes, woods."""
    POST = "post"
    LAMP = "lamp"
    BUILDING = "building"
    OTHER = "other"


KIND_OF_TYPE = {
    "tree": Kind.TREE,
    "vegetation": Kind.PLANTS,
    "pole": Kind.POST,
    "trafficlight": Kind.POST,
    "streetlamp": Kind.LAMP,
    "building": Kind.BUILDING,
}

WORDS_OF_KIND = {
    Kind.LAMP: {"lamp", "lamps", "streetlamp", "streetlight", "lantern", "luminaire", "laterne", "leuchte"},
    Kind.TREE: {
        *("tree", "trees", "baum", "oak", "pine", "palm", "birch", "maple", "linden", "poplar", "spruce", "fir"),
        *("cypress", "willow", "beech", "acacia", "chestnut", "eiche", "buche", "ahorn", "linde", "birke"),
    },
    Kind.PLANTS: {"hedge", "bush", "bushes", "shrub", "vegetation", "hecke", "busch"},
    Kind.POST: {"pole", "post", "mast", "column", "gantry", "ampel", "trafficlight", "pfosten", "signalpole"},
    Kind.BUILDING: {"building", "house", "haus", "gebaeude", "garage", "church", "school"},
}


@dataclass(frozen=True, eq=False)
class Post:
    """A post of the map.

    Parameters
    ----------
    xy : (2,) float64, metres
        Foot in plan.
    height, thickness : float, metres
        Height and thickness, zero if the map does not give them.
    words : frozenset of str
        Words of its name and type.
    is_lamp : bool
        Whether it carries a street light.
    """

    xy: Float
    height: float
    thickness: float
    words: frozenset[str]
    is_lamp: bool


def words_of(name: str) -> frozenset[str]:
    """Return the words of a name in lower case; ``StreetLight_03`` has two."""
    parts = re.findall(r"[A-ZÄÖÜ]?[a-zäöüß]+|[A-ZÄÖÜ]+", name)
    return frozenset(word.lower() for word in parts)


def kind_of(placed: PlacedObject) -> Kind:
    """Return the kind of an object."""
    if placed.kind in FLAT_KINDS:
        return Kind.FLAT
    words = words_of(placed.name)
    if "lamp" in placed.name.lower() or {"street", "light"} <= words:
        return Kind.LAMP
    if placed.kind in KIND_OF_TYPE:
        return KIND_OF_TYPE[placed.kind]
    if "building" in placed.name.lower():
        return Kind.BUILDING
    return _kind_by_looks(placed, words) if placed.kind in VAGUE_TYPES else Kind.OTHER


def _kind_by_looks(placed: PlacedObject, words: frozenset[str]) -> Kind:
    """Return the kind of an object from the words of its name and its shape."""
    named = next((kind for kind, of_kind in WORDS_OF_KIND.items() if words & of_kind), None)
    if named is Kind.POST and size_of(placed) > MAX_POST_THICKNESS:
        return Kind.OTHER
    return named or (Kind.POST if _is_slender(placed) else Kind.OTHER)


def post_of(placed: PlacedObject) -> Post | None:
    """Return an object as a post, None if it is something else."""
    kind = kind_of(placed)
    if kind not in (Kind.POST, Kind.LAMP):
        return None
    middle = placed.outlines[0].base[:, :2].mean(axis=0) if placed.outlines else placed.position[:2]
    words = words_of(placed.name) | words_of(placed.kind)
    return Post(middle, height_of(placed), _thickness(placed), words, kind is Kind.LAMP)


def height_of(placed: PlacedObject) -> float:
    """Return the height of an object including its outlines, metres; zero if the map does not give it."""
    height = max([placed.height, *(float(outline.height.max()) for outline in placed.outlines)])
    return height if height >= MIN_HEIGHT else 0.0


def size_of(placed: PlacedObject) -> float:
    """Return the longest side of an object in plan, metres; zero if the map does not give it."""
    sides = [float(np.ptp(outline.base[:, :2], axis=0).max()) for outline in placed.outlines]
    return max(sides) if sides else max(placed.length, placed.width, 2 * placed.radius)


def _thickness(placed: PlacedObject) -> float:
    """Return the shortest side of an object in plan, metres; zero if the map does not give it."""
    if placed.outlines:
        return size_of(placed)
    return min((side for side in (placed.length, placed.width, 2 * placed.radius) if side > 0), default=0.0)


def _is_slender(placed: PlacedObject) -> bool:
    height, size = height_of(placed), size_of(placed)
    return height >= MIN_POST_HEIGHT and 0 < size <= MAX_POST_THICKNESS and height >= MIN_POST_SLENDERNESS * size
