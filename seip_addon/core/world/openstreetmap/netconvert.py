"""Streets of an extract as an OpenDRIVE map, made by SUMO's netconvert."""

import re
from collections.abc import Generator, Iterable
from pathlib import Path

from ...errors import SeipError
from ...progress import Progress
from ...sumo_programs import find_sumo, run
from .connecting_roads import mended_text
from .edge_lines import moved_edges
from .street_lanes import SIDEWALK_WIDTH
from .streets import JOIN_DISTANCE, StreetFile

_SOURCE = re.compile(r'\s*<userData code="sumoId" value="([^"]*)"/>')
_ROAD = re.compile(r'<road [^>]*?id="([^"]*)"')
TYPE_FILES = ("osmNetconvert.typ.xml", "osmNetconvertBicycle.typ.xml")


def convert(
    streets: StreetFile, source: Path, target: Path, sumo: Iterable[Path] = ()
) -> Generator[Progress, None, dict[str, str]]:
    """Convert streets to an OpenDRIVE map.

    Parameters
    ----------
    streets : StreetFile
        Streets as written to ``source``.
    target : Path
        Map to write.
    sumo : iterable of Path
        Folders to search for SUMO first.

    Returns
    -------
    dict of str to str
        Source of each road of the map: the id of the way that it was made from, with a minus sign if the road leads
        the opposite way, and a suffix that netconvert adds.

    Raises
    ------
    SeipError
        SUMO is not installed, or refuses the streets.
    """
    programs = find_sumo(sumo)
    if programs.home is None:
        raise SeipError("SUMO's data files were not found near its programs: set SUMO_HOME to the folder with them")
    types = ",".join(str(programs.home / "data" / "typemap" / name) for name in TYPE_FILES)
    network, lines = (target.with_suffix(suffix) for suffix in (".net.xml", ".edg.xml"))
    common = [
        *("--no-turnarounds", "--output.street-names", "--output.original-names"),
        *("--no-warnings", "--xml-validation", "never", "--aggregate-warnings", 1),
    ]
    options: list[object] = [
        *("--osm-files", source, "--output-file", network, "--precision", 6, "--type-files", types),
        *("--geometry.remove", "--ramps.guess", "--junctions.join", "--junctions.join-dist", JOIN_DISTANCE),
        *("--tls.guess-signals", "--tls.discard-simple", "--tls.join"),
        *("--osm.sidewalks", "--default.sidewalk-width", SIDEWALK_WIDTH, *common),
    ]
    if streets.left_hand:
        options += ["--lefthand"]
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
    yield from run(programs, programs.netconvert, options, "streets of the extract")
    # Lanes move to their places in a second run, with the junctions of the first: which nodes netconvert joins to one
    # junction depends on the shapes of the edges between them.
    moved = yield from moved_edges(network, streets.ways, left_hand=streets.left_hand)
    lines.write_text("\n".join(["<edges>", *moved, "</edges>", ""]), encoding="utf-8")
    options = ["--sumo-net-file", network, "--edge-files", lines, "--opendrive-output", target, *common]
    options += ["--crossings.guess", "--junctions.corner-detail", 5]
    if streets.left_hand:
        options += ["--lefthand", "--opendrive-output.lefthand-left"]
    yield from run(programs, programs.netconvert, options, "lanes of the extract")
    network.unlink()
    lines.unlink()
    text = _corrected(target.read_text(encoding="utf-8"), left_hand=streets.left_hand)
    sources = _sources(text)
    target.write_text(mended_text(_SOURCE.sub("", text)), encoding="utf-8")
    return sources


def _sources(text: str) -> dict[str, str]:
    """Return the source way of each road of a map, from the ``sumoId`` that netconvert writes."""
    found = {}
    for piece in re.split(r"(?=<road )", text):
        road, source = _ROAD.match(piece), _SOURCE.search(piece)
        if road and source:
            found[road[1]] = source[1]
    return found


def _corrected(text: str, *, left_hand: bool) -> str:
    """Return the text of a map of netconvert without dates, with corrected names and the side of traffic."""
    # netconvert escapes the names of streets twice: "Smith & Sons" arrives as "Smith &amp;amp; Sons".
    text = re.sub(r"&amp;(amp|apos|gt|lt|quot);", r"&\1;", text)
    # The first comment holds the time of the run and the paths of its files, and the header holds its date. With them
    # the same streets would give different bytes each time, and results that carry a digest of the map would be stale.
    text = re.sub(r"<!--.*?-->\s*", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'(<header [^>]*?)date="[^"]*"', r'\1date=""', text, count=1)
    # Roads within junctions have no street name; netconvert writes SUMO's internal id (":12_0") in its place, which
    # would appear in results as the name of a street.
    text = re.sub(r'(<road [^>]*?)name=":[^"]*"', r'\1name=""', text)
    # Lanes that only some vehicles may use are restricted ones; in streets of an extract these are lanes of buses.
    text = text.replace('type="restricted"', 'type="bus"')
    # netconvert writes no rule of traffic, and OpenDRIVE's default is right-hand traffic.
    return text.replace("<road ", '<road rule="LHT" ') if left_hand else text
