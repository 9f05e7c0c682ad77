"""Streets of an extract as a network, made by SUMO's netconvert."""

import re
from collections.abc import Generator, Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.progress import Progress
from ...geometry.plan import beside
from ...programs.sumo_programs import find_sumo, run
from ..traffic_simulation.street_network import NetworkEdge, StreetNetwork, read_network, shape_text
from .extract import Way
from .network_map import PRECISION
from .street_lanes import SIDEWALK_WIDTH, divider_offset
from .streets import JOIN_DISTANCE, StreetFile, way_id

TYPE_FILES = ("osmNetconvert.typ.xml", "osmNetconvertBicycle.typ.xml")


def convert(
    streets: StreetFile, source: Path, target: Path, sumo: Iterable[Path] = ()
) -> Generator[Progress, None, None]:
    """Convert streets to a network.

    Parameters
    ----------
    streets : StreetFile
        Streets as written to ``source``.
    target : Path
        Network to write (.net.xml), in the folder of the source.
    sumo : iterable of Path
        Folders to search for SUMO first.

    Raises
    ------
    SeipError
        SUMO is not installed, or refuses the streets.
    """
    programs = find_sumo(sumo)
    if programs.home is None:
        raise SeipError("SUMO's data files were not found near its programs: set SUMO_HOME to the folder with them")
    first, lines = (target.with_name(f"{target.name}.{kind}.xml") for kind in ("first", "edg"))
    common: list[object] = [
        *("--no-turnarounds", "--output.street-names"),
        *("--no-warnings", "--xml-validation", "never", "--aggregate-warnings", 1),
        *["--lefthand"] * streets.left_hand,
    ]
    types = ",".join(str(programs.home / "data" / "typemap" / name) for name in TYPE_FILES)
    options = ["--osm-files", source, "--output-file", first, "--type-files", types, *_layout(streets), *common]
    yield from run(programs, programs.netconvert, options, "streets of the extract", target.parent)
    # Lanes move to their places in a second run, with the junctions of the first: which nodes netconvert joins to one
    # junction depends on the shapes of the edges between them.
    moved = _moved_edges(read_network(first), streets.ways)
    lines.write_text("\n".join(["<edges>", *moved, "</edges>", ""]), encoding="utf-8")
    options = ["--sumo-net-file", first, "--edge-files", lines, "--output-file", target, "--precision", PRECISION]
    options += [*common, "--crossings.guess", "--junctions.corner-detail", 5]
    yield from run(programs, programs.netconvert, options, "lanes of the extract", target.parent)
    first.unlink()
    lines.unlink()
    # The first comment holds the time of the run and the paths of its files. With it the same streets would give
    # different bytes each time, and results that carry a digest of the map would be stale.
    text = target.read_text(encoding="utf-8")
    target.write_text(re.sub(r"<!--.*?-->\s*", "", text, count=1, flags=re.DOTALL), encoding="utf-8")


def _layout(streets: StreetFile) -> list[object]:
    """Return the options by which streets are laid out."""
    options: list[object] = [
        *("--precision", 6, "--geometry.remove", "--ramps.guess"),
        *("--junctions.join", "--junctions.join-dist", JOIN_DISTANCE),
        *("--tls.guess-signals", "--tls.discard-simple", "--tls.join"),
        *("--osm.sidewalks", "--default.sidewalk-width", SIDEWALK_WIDTH),
    ]
    # netconvert would join the ends of slip lanes of any length, and the ends of bridges with junctions below them
    apart = sorted(streets.structures.ends.union(streets.slip_ends, *streets.roundabouts))
    if apart:
        options += ["--junctions.join-exclude", ",".join(map(str, apart))]
    if streets.elevated:
        options += ["--osm.elevation"]
    # --geometry.remove merges consecutive edges. Streets on bridges and in underpasses must stay separate roads,
    # because their heights differ from those of the streets next to them. netconvert names the parts of a way `id#n`.
    kept = [
        f"{sign}{number}{part}"
        for number, way in sorted(streets.ways.items())
        if number in streets.structures.apart
        for part in ("", *(f"#{place}" for place in range(len(way.nodes))))
        for sign in ("", "-")
    ]
    if kept:
        options += ["--geometry.remove.keep-edges.explicit", ",".join(kept)]
    return options


def _moved_edges(network: StreetNetwork, ways: Mapping[int, Way]) -> Iterator[str]:
    """Yield the elements of a file of edges that move those of a network to where the lanes of their ways begin.

    netconvert lays the line between the directions of a street along its way, or centres a street with its pavements.
    In OpenStreetMap the line of a way is the middle of the carriageway, unless the tag ``placement`` says otherwise.

    Parameters
    ----------
    network : StreetNetwork
        Network of netconvert in which the lines of edges are those of their ways.
    ways : mapping of int to Way
        Streets by the id under which they were written for netconvert.
    """
    lines = {name: _line(edge, network) for name, edge in network.edges.items()}
    leaving: dict[str, list[NetworkEdge]] = {}
    entering: dict[str, list[NetworkEdge]] = {}
    for edge in network.edges.values():
        leaving.setdefault(edge.from_node, []).append(edge)
        entering.setdefault(edge.to_node, []).append(edge)
    for name, edge in network.edges.items():
        way = ways.get(way_id(name))
        if way is None or "highway" not in way.tags:
            continue
        backward = name.startswith("-")
        aside = divider_offset(way.tags, left_hand=network.left_hand) * (-1.0 if backward else 1.0)
        aside -= _off(edge, left_hand=network.left_hand)
        # At a joint with another street the line bends as if both were one, so that moved lines meet there.
        before = _only(lines[one.id][-2] for one in entering.get(edge.from_node, ()) if one.from_node != edge.to_node)
        after = _only(lines[one.id][1] for one in leaving.get(edge.to_node, ()) if one.to_node != edge.from_node)
        own = lines[name]
        moved = beside(np.vstack([*before, own, *after]), -aside)[len(before) :][: len(own)]
        yield f'<edge id="{name}" spreadType="right" shape="{shape_text(moved, 6)}"/>'


def _line(edge: NetworkEdge, network: StreetNetwork) -> Float:
    """Return the line of an edge (n, 3)."""
    if edge.line is not None:
        return edge.line
    return np.array([(*network.nodes[node], 0.0) for node in (edge.from_node, edge.to_node)])


def _off(edge: NetworkEdge, *, left_hand: bool) -> float:
    """Return how far the line of an edge is to the right of the line of its way, metres.

    netconvert moves the line of a street that it centres when it adds cycle lanes and pavements.
    """
    outer = sum(lane.width for lane in edge.lanes if lane.allowed in ({"pedestrian"}, {"bicycle"}))
    return (-0.5 if left_hand else 0.5) * outer if edge.centred else 0.0


def _only(points: Iterator[Float]) -> list[Float]:
    """Return the point in a list if there is one only, otherwise an empty list."""
    found = list(points)
    return found if len(found) == 1 else []
