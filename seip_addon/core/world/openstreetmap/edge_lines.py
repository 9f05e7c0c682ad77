"""Lines of netconvert's edges, moved so that the lanes of each street lie where OpenStreetMap draws them.

netconvert lays the line between the directions of a street along its way, or centres a street with its pavements. In
OpenStreetMap the line of a way is the middle of the carriageway, unless the tag ``placement`` says otherwise.
"""

import itertools
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import Float
from ...progress import Progress
from ...storage.xml_stream import Attributes, read_tags
from .extract import Way
from .street_lanes import divider_offset

MAX_MITRE = 2.0  # largest ratio of the length of a mitre at a bend to the distance by which a line is moved


@dataclass(frozen=True, eq=False)
class _Edge:
    """Ends of an edge, its line (n, 2 or 3), and how far that is to the right of the line of its way, metres."""

    start: str
    end: str
    line: Float
    off: float


def moved_edges(network: Path, ways: Mapping[int, Way], *, left_hand: bool) -> Generator[Progress, None, list[str]]:
    """Return the elements of a file of edges that move those of a network to where the lanes of their ways begin.

    Parameters
    ----------
    network : Path
        Network of netconvert (.net.xml) in which the lines of edges are those of their ways.
    ways : mapping of int to Way
        Streets by the id under which they were written for netconvert.
    """
    edges = yield from _read(network, left_hand=left_hand)
    return list(_moved_edges(edges, ways, left_hand=left_hand))


def _read(network: Path, *, left_hand: bool) -> Generator[Progress, None, dict[str, _Edge]]:
    """Return the edges of a network outside its junctions by their ids."""
    places: dict[str, str] = {}
    found: dict[str, Attributes] = {}
    outer: dict[str, float] = {}  # widths of the cycle lanes and pavements of each edge

    def start(tag: str, attributes: Attributes) -> None:
        if tag == "edge" and "function" not in attributes:
            found[attributes["id"]] = attributes
        elif tag == "junction":
            places[attributes["id"]] = f"{attributes['x']},{attributes['y']}"
        elif tag == "lane" and attributes.get("allow") in ("pedestrian", "bicycle"):
            name = attributes["id"].rpartition("_")[0]
            outer[name] = outer.get(name, 0.0) + float(attributes["width"])

    yield from read_tags(network, start, lambda _tag: None, cure="build the site again")
    edges = {}
    for name, given in found.items():
        ends = given["from"], given["to"]
        text = given.get("shape") or " ".join(places[end] for end in ends)
        # netconvert moves the line of a street that it centres when it adds cycle lanes and pavements.
        off = (-0.5 if left_hand else 0.5) * outer.get(name, 0.0) if given.get("spreadType") == "center" else 0.0
        edges[name] = _Edge(*ends, np.array([point.split(",") for point in text.split()], dtype=np.float64), off)
    return edges


def _moved_edges(edges: Mapping[str, _Edge], ways: Mapping[int, Way], *, left_hand: bool) -> Iterator[str]:
    leaving: dict[str, list[str]] = {}
    entering: dict[str, list[str]] = {}
    for name, edge in edges.items():
        leaving.setdefault(edge.start, []).append(name)
        entering.setdefault(edge.end, []).append(name)
    for name, edge in edges.items():
        way = ways.get(way_id(name))
        if way is None or "highway" not in way.tags:
            continue
        backward = name.startswith("-")
        aside = divider_offset(way.tags, left_hand=left_hand) * (-1.0 if backward else 1.0) - edge.off
        # At a joint with another street the line bends as if both were one, so that moved lines meet there.
        before = _only(edges[one].line[-2] for one in entering.get(edge.start, ()) if edges[one].start != edge.end)
        after = _only(edges[one].line[1] for one in leaving.get(edge.end, ()) if edges[one].end != edge.start)
        line = np.vstack([*before, edge.line[:, :2], *after])
        moved = np.column_stack([_moved(line, aside)[len(before) :][: len(edge.line)], edge.line[:, 2:]])
        shape = " ".join(",".join(f"{value:.6f}" for value in point) for point in moved.tolist())
        yield f'<edge id="{name}" spreadType="right" shape="{shape}"/>'


def _only(points: Iterator[Float]) -> list[Float]:
    """Return the point in a list if there is one only, otherwise an empty list."""
    found = [point[:2] for point in points]
    return found if len(found) == 1 else []


def _moved(line: Float, aside: float) -> Float:
    """Return a line (n, 2) moved to its right by `aside` metres."""
    steps = np.diff(line, axis=0)
    along = steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]
    right = np.column_stack([along[:, 1], -along[:, 0]])
    # A corner moves along the bisector of its bend, so far that both sides of it move by the same distance.
    first, second = np.vstack([right[:1], right]), np.vstack([right, right[-1:]])
    bisector = (first + second) / np.maximum(1.0 + (first * second).sum(axis=1), 2.0 / MAX_MITRE**2)[:, None]
    moved: Float = line + aside * bisector
    return moved


def way_id(name: str) -> int:
    """Return the id of the way that an edge, called for example ``-12#3``, was made from; 0 if it has none."""
    digits = "".join(itertools.takewhile(str.isdigit, name.removeprefix("-")))
    return int(digits) if digits else 0
