"""Streets of an extract as an OpenDRIVE map, made by SUMO's netconvert."""

import re
from collections.abc import Generator
from pathlib import Path

from ...errors import SeipError
from ...progress import Progress
from ...sumo_programs import find_sumo, run
from .connecting_roads import mended_text
from .streets import JOIN_DISTANCE, SIDEWALK_WIDTH, StreetFile

_SOURCE = re.compile(r'\s*<userData code="sumoId" value="([^"]*)"/>')
_ROAD = re.compile(r'<road [^>]*?id="([^"]*)"')
TYPE_FILES = ("osmNetconvert.typ.xml", "osmNetconvertBicycle.typ.xml")


def convert(streets: StreetFile, source: Path, target: Path) -> Generator[Progress, None, dict[str, str]]:
    """Convert streets to an OpenDRIVE map.

    Parameters
    ----------
    streets : StreetFile
        What was written to ``source``.
    target : Path
        The map to write.

    Returns
    -------
    dict of str to str
        For each road of the map the way that it was made of: its id, with a minus sign where the road leads the other
        way, and what netconvert adds.

    Raises
    ------
    SeipError
        SUMO is not installed, or refuses the streets.
    """
    programs = find_sumo()
    if programs.home is None:
        raise SeipError("SUMO's files are not found beside its programs: set SUMO_HOME to the folder that holds them")
    types = ",".join(str(programs.home / "data" / "typemap" / name) for name in TYPE_FILES)
    options: list[object] = [
        *("--osm-files", source, "--opendrive-output", target, "--type-files", types),
        *("--geometry.remove", "--ramps.guess", "--junctions.join", "--junctions.join-dist", JOIN_DISTANCE),
        *("--tls.guess-signals", "--tls.discard-simple", "--tls.join", "--no-turnarounds"),
        *("--osm.sidewalks", "--default.sidewalk-width", SIDEWALK_WIDTH, "--crossings.guess"),
        *("--junctions.corner-detail", 5, "--output.street-names", "--output.original-names"),
        *("--no-warnings", "--xml-validation", "never", "--aggregate-warnings", 1),
    ]
    if streets.left_hand:
        options += ["--lefthand", "--opendrive-output.lefthand-left"]
    # netconvert joins slip lanes of any length, and what leads over a street with what lies below
    apart = sorted(streets.structures.ends.union(streets.slip_ends, *streets.roundabouts))
    if apart:
        options += ["--junctions.join-exclude", ",".join(map(str, apart))]
    if streets.elevated:
        options += ["--osm.elevation"]
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
    text = _without_dates(target.read_text(encoding="utf-8"), streets)
    sources = _sources(text)
    target.write_text(mended_text(_SOURCE.sub("", text)), encoding="utf-8")
    return sources


def _sources(text: str) -> dict[str, str]:
    """Return the way that each road of a map was made of, as netconvert notes it in the map."""
    found = {}
    for piece in re.split(r"(?=<road )", text):
        road, source = _ROAD.match(piece), _SOURCE.search(piece)
        if road and source:
            found[road[1]] = source[1]
    return found


def _without_dates(text: str, streets: StreetFile) -> str:
    """Return a map that is the same whenever it is made, and says on which side traffic keeps.

    Names in it are escaped once: netconvert escapes them twice. Its own ids (``:12_0``) are not names of streets.
    """
    text = re.sub(r"&amp;(amp|apos|gt|lt|quot);", r"&\1;", text)
    text = re.sub(r"<!--.*?-->\s*", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'(<header [^>]*?)date="[^"]*"', r'\1date=""', text, count=1)
    text = re.sub(r'(<road [^>]*?)name=":[^"]*"', r'\1name=""', text)
    return text.replace("<road ", '<road rule="LHT" ') if streets.left_hand else text
