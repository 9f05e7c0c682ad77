"""Offset of SUMO networks from their map."""

import os
from pathlib import Path

import numpy as np

from ...arrays import Float
from ...errors import SeipError
from ...limits import MAP_COORDINATE
from ...storage.xml_stream import Attributes, read_tags


def read_net_offset(path: str | os.PathLike[str]) -> Float:
    """Return the offset (2,) in metres of a SUMO network: its coordinates are the map's plus this.

    Raises
    ------
    SeipError
        The file cannot be read, or is not a SUMO network.
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
    except (IndexError, ValueError) as error:
        raise SeipError(f"{Path(path).name} is not a SUMO network: it has no netOffset; name a .net.xml") from error
    MAP_COORDINATE.require([x, y], Path(path).name, "netOffset", "name a .net.xml that netconvert wrote")
    return np.array([x, y])
