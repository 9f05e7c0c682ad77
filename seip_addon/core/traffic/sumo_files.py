"""What all files of SUMO have in common."""

import math
import os
from pathlib import Path

import numpy as np

from ..arrays import Float
from ..errors import SeipError
from ..storage.xml_stream import Attributes, read_tags

MAX_COORDINATE = 1e8  # metres of a coordinate at most: more than the circumference of the Earth


def read_net_offset(path: str | os.PathLike[str]) -> Float:
    """Return the offset (2,) in metres of a SUMO network: its coordinates are the map's plus this.

    Raises
    ------
    SeipError
        The file cannot be read, or is no SUMO network.
    """
    found: list[str] = []

    def take(tag: str, attributes: Attributes) -> None:
        if tag == "location":
            found.append(attributes.get("netOffset", ""))

    for _ in read_tags(path, take):
        if found:
            break
    try:
        x, y = (float(number) for number in found[0].split(","))
    except (IndexError, ValueError):
        x = y = math.nan
    if not (abs(x) <= MAX_COORDINATE and abs(y) <= MAX_COORDINATE):
        raise SeipError(f"{Path(path).name} is no SUMO network: it says no netOffset; name a .net.xml")
    return np.array([x, y])
