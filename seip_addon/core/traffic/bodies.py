"""What road users look like to a LiDAR, and to people: closed bodies of few triangles."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import Float, Text
from ..errors import SeipError
from .body_parts import Part
from .people_shapes import bicycle, motorcycle, pedestrian
from .trajectories import CATEGORIES, RoadUser
from .vehicle_shapes import bus, car, truck, van

REFLECTIVITY: Mapping[str, float] = {
    "glass": 0.05,  # nearly all goes through or is mirrored away
    "tyre": 0.05,
    "trim": 0.08,
    "rim": 0.45,
    "frame": 0.35,
    "headlamp": 0.60,
    "tail lamp": 0.60,  # its reflectors send back what comes
    "cargo box": 0.65,
    "skin": 0.50,
    "hair": 0.20,
    "trousers": 0.25,
}
"""Share of near infrared (905 nm) that each material sends back, assumed; paint and clothes have the road user's."""

COLOURS = (
    (0.12, "black"),
    (0.24, "blue"),
    (0.34, "green"),
    (0.44, "red"),
    (0.56, "grey"),
    (0.70, "silver"),
    (1.00, "white"),
)
"""Up to which reflectivity paint and clothes are shown in which colour."""

PAINTED = ("paint", "cloth")
"""Materials that have the road user's reflectivity; in a body a colour follows: ``paint red``."""

_TWO_WHEELERS_AND_PEOPLE: Mapping[str, Callable[[], list[Part]]] = {
    "motorcycle": motorcycle,
    "bicycle": bicycle,
    "pedestrian": pedestrian,
}
_VEHICLES: Mapping[str, Callable[[float, float, float], list[Part]]] = {
    "car": car,
    "van": van,
    "truck": truck,
    "bus": bus,
}


@dataclass(frozen=True, eq=False)
class Body:
    """The surface of a road user in its own axes; n triangles.

    The origin is the middle of the underside; x points forward, y left, z up.
    Arrays are shared between road users of one size and cannot be written.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners counter-clockwise seen from outside; closed parts that may reach into each other.
    reflectivity : (n,) float64, 0 to 1
    material : (n,) str
        Keys of `scene.materials.COLOURS`.
    """

    triangles: Float
    reflectivity: Float
    material: Text

    def __len__(self) -> int:
        """Return the number of triangles."""
        return len(self.triangles)


def fitted_body(user: RoadUser) -> Body:
    """Return the body of a road user, whose bounding box is exactly its length × width × height.

    Road users of one category, size and paint get the same object, and those
    of one category and size the same array of triangles.

    Returns
    -------
    Body

    Raises
    ------
    SeipError
        There is no such category, or no such size.
    """
    if user.category not in CATEGORIES:
        raise SeipError(
            f"road user {user.name!r} is a {user.category!r}, which has no body; it may be {', '.join(CATEGORIES)}"
        )
    size = (user.length, user.width, user.height)
    if not all(0 < side < np.inf for side in size):
        raise SeipError(
            f"road user {user.name!r} is {' × '.join(f'{side:g}' for side in size)} m large; "
            "give its type a length, width and height above zero"
        )
    return _painted(user.category, *size, user.paint)


def colour_of(paint: float) -> str:
    """Return the colour in which a reflectivity of paint or clothes is shown."""
    return next((name for limit, name in COLOURS if paint <= limit), COLOURS[-1][1])


@functools.cache
def _painted(category: str, length: float, width: float, height: float, paint: float) -> Body:
    triangles, material = _shape(category, length, width, height)
    painted = np.isin(material, PAINTED)
    reflectivity = np.array([paint if own else REFLECTIVITY[name] for name, own in zip(material, painted, strict=True)])
    named = np.where(painted, np.char.add(material, f" {colour_of(paint)}"), material)
    for array in (reflectivity, named):
        array.flags.writeable = False
    return Body(triangles, reflectivity, named)


@functools.cache
def _shape(category: str, length: float, width: float, height: float) -> tuple[Float, Text]:
    """Return the triangles of a category and size, and their materials before any paint."""
    if category in _VEHICLES:
        parts = _VEHICLES[category](length, width, height)
    else:
        parts = _TWO_WHEELERS_AND_PEOPLE[category]()
    triangles = _fitted(np.concatenate([part.triangles for part in parts]), np.array([length, width, height]))
    material = np.repeat([part.material for part in parts], [len(part.triangles) for part in parts])
    for array in (triangles, material):
        array.flags.writeable = False
    return triangles, material


def _fitted(triangles: Float, size: Float) -> Float:
    """Return triangles (n, 3, 3) stretched to a size, over the middle of their underside."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    share = (triangles - low) / (high - low)
    fitted: Float = (share - [0.5, 0.5, 0.0]) * size
    return fitted
