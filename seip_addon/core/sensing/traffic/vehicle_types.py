"""Category and size of SUMO's vehicle types."""

import math
import os
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...base.errors import SeipError
from ...base.limits import ROAD_USER_SIZE
from ...base.progress import Progress
from ...storage.xml_stream import Attributes, quoted, read_tags

_SHAPES_OF = {
    "pedestrian": ("pedestrian",),
    "bicycle": ("bicycle", "scooter"),
    "motorcycle": ("moped", "motorcycle"),
    "car": ("passenger", "passenger/sedan", "passenger/hatchback", "passenger/wagon", "taxi", "evehicle", "police"),
    "van": ("passenger/van", "delivery", "emergency"),
    "truck": ("firebrigade", "truck", "truck/semitrailer", "truck/trailer"),
    "bus": ("bus", "bus/coach", "bus/flexible", "bus/trolley"),
}
"""Values of guiShape by category; guiShape takes precedence over the vClass."""
_SHAPES = {shape: category for category, shapes in _SHAPES_OF.items() for shape in shapes}


@dataclass(frozen=True)
class VehicleType:
    """A type of road user.

    Parameters
    ----------
    category : str
        One of `seip_addon.core.sensing.traffic.CATEGORIES`.
    length, width, height : float, metres
        Dimensions.
    """

    category: str
    length: float
    width: float
    height: float


CAR = VehicleType("car", 5.0, 1.8, 1.5)  # SUMO's default vehicle
PERSON = VehicleType("pedestrian", 0.215, 0.478, 1.719)  # SUMO's default person

_CLASSES = {
    "pedestrian": PERSON,
    "wheelchair": VehicleType("pedestrian", 0.8, 0.8, 1.5),
    "bicycle": VehicleType("bicycle", 1.6, 0.65, 1.7),
    "scooter": VehicleType("bicycle", 1.2, 0.5, 1.7),
    "moped": VehicleType("motorcycle", 2.1, 0.78, 1.7),
    "motorcycle": VehicleType("motorcycle", 2.2, 0.9, 1.5),
    "delivery": VehicleType("van", 6.5, 2.16, 2.86),
    "emergency": VehicleType("van", 6.5, 2.16, 2.86),
    "truck": VehicleType("truck", 7.1, 2.4, 2.4),
    "trailer": VehicleType("truck", 16.5, 2.55, 4.0),
    "bus": VehicleType("bus", 12.0, 2.5, 3.4),
    "coach": VehicleType("bus", 14.0, 2.6, 4.0),
    "tram": VehicleType("bus", 22.0, 2.4, 3.2),
}
"""Default sizes by vClass (SUMO's "Vehicle Type Parameter Defaults"); all other classes are cars."""


BUILT_IN = {
    "DEFAULT_VEHTYPE": CAR,
    "DEFAULT_TAXITYPE": CAR,
    "DEFAULT_PEDTYPE": PERSON,
    "DEFAULT_BIKETYPE": _CLASSES["bicycle"],
}
"""Types that SUMO defines without a file."""


def read_vehicle_types(paths: Sequence[str | os.PathLike[str]]) -> Generator[Progress, None, dict[str, VehicleType]]:
    """Read the types from route and additional files, those within distributions included.

    Parameters
    ----------
    paths : sequence of path-like
        XML files, with or without gzip.

    Returns
    -------
    dict of str to VehicleType
        Types by id, SUMO's own included. Missing values are SUMO's defaults for the vClass.

    Raises
    ------
    SeipError
        A file cannot be read, or contains an invalid size.
    """
    types = dict(BUILT_IN)
    for path in paths:
        name = Path(path).name

        def take(tag: str, attributes: Attributes, name: str = name) -> None:
            if tag == "vType":
                types[attributes.get("id", "")] = _vehicle_type(attributes, name)

        yield from read_tags(path, take)
    return types


def _vehicle_type(attributes: Attributes, file: str) -> VehicleType:
    usual = _CLASSES.get(attributes.get("vClass", "passenger"), CAR)
    return VehicleType(
        category=_SHAPES.get(attributes.get("guiShape", ""), usual.category),
        length=_size(attributes, "length", usual.length, file),
        width=_size(attributes, "width", usual.width, file),
        height=_size(attributes, "height", usual.height, file),
    )


def _size(attributes: Attributes, what: str, usual: float, file: str) -> float:
    text = attributes.get(what)
    if text is None:
        return usual
    try:
        size = float(text)
    except ValueError:
        size = math.nan
    if not ROAD_USER_SIZE.allow(size):
        kind = quoted(attributes.get("id", ""))
        raise SeipError(f"{file}: {what}={quoted(text)} of vType {kind} is not a valid size in metres; correct it")
    return size
