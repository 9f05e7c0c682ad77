"""Notes on what is assumed about the streets of an extract, one sentence each."""

from collections.abc import Collection, Iterable, Iterator, Sequence

from ...base.counts import counted
from ..streetscape.levels import UNNAMED_ROAD
from .extract import Node, Way
from .signals import SIGNAL_REACH
from .street_lanes import has_lane_count, implausible_lanes, lane_counts, shares_lane, usual_lanes
from .streets import SHORT_PIECE, shown_name

MAX_NAMED = 6  # street names in a note at most
MAX_SHOWN = 12  # characters of a tag's value in a note at most


def lone_signals(nodes: Sequence[Node]) -> Iterator[str]:
    """Yield a note on traffic signals that have no post."""
    if nodes:
        places = " and ".join(f"{node.latitude:.5f}, {node.longitude:.5f}" for node in nodes[:3])
        yield (
            f"traffic signals that belong to no junction within {SIGNAL_REACH:g} m have no post: {len(nodes)}, "
            f"at {places}{' and elsewhere' if len(nodes) > 3 else ''}; describe a signal_pole where one stands"
        )


def _names(ways: Iterable[Way]) -> str:
    """Return the names of streets for a note, in alphabetical order."""
    unnamed = "streets without a name"
    names = {shown_name(way.tags) or unnamed for way in ways}
    known = sorted(names, key=lambda name: (name == unnamed, name))
    return ", ".join(known[:MAX_NAMED]) + (f" and {len(known) - MAX_NAMED} more" * (len(known) > MAX_NAMED))


def assumed_lanes(ways: Iterable[Way]) -> Iterator[str]:
    """Yield notes on streets without a number of lanes in the extract."""
    streets: dict[int, list[Way]] = {}
    for way in ways:
        if "highway" in way.tags and not has_lane_count(way.tags) and not implausible_lanes(way.tags):
            streets.setdefault(usual_lanes(way.tags), []).append(way)
    for lanes, found in sorted(streets.items()):
        each = "one lane is" if lanes == 1 else f"{lanes} lanes are"
        yield f"{each} assumed in each direction of streets without a number of lanes in the extract: {_names(found)}"


def lane_notes(ways: Sequence[Way], widened: Collection[Way]) -> Iterator[str]:
    """Yield notes on pieces with the lanes of their neighbours, and on streets with one lane for both directions."""
    pieces = [way for way in ways if way in widened]
    shared = [way for way in ways if "highway" in way.tags and shares_lane(way.tags)]
    if pieces:
        yield (
            f"pieces shorter than {SHORT_PIECE:g} m without a number of lanes have those of their neighbours: "
            f"{_names(pieces)}"
        )
    if shared:
        yield f"one lane serves both directions of {_names(shared)}, as the extract gives one lane in all"


def implausible_lane_notes(ways: Iterable[Way]) -> Iterator[str]:
    """Yield a note on each street whose tags give an implausible number of lanes."""
    notes = []
    for way in ways:
        given = implausible_lanes(way.tags) if "highway" in way.tags else {}
        if given:
            name = shown_name(way.tags) or UNNAMED_ROAD
            values = ", ".join(
                f"{key}={value[:MAX_SHOWN]}{'…' * (len(value) > MAX_SHOWN)}" for key, value in given.items()
            )
            lanes = sum(lane_counts(way.tags).values())
            are = counted(lanes, "lane in all is", "lanes in all are")
            notes.append(f"the extract gives {name} {values}, which is not a plausible number of lanes: {are} assumed")
    yield from dict.fromkeys(notes)


def assumed_crossings(number: int) -> Iterator[str]:
    """Yield a note on crossings that are not mapped in the extract."""
    if number:
        are = counted(number, "crossing of pedestrians at junctions is", "crossings of pedestrians at junctions are")
        yield f"{are} assumed: the extract maps none there"
