"""Streets of an extract as an OpenDRIVE map, made by SUMO's netconvert."""

import re
from collections.abc import Generator
from pathlib import Path

from ..errors import SeipError
from ..progress import Progress
from ..traffic.sumo_programs import find_sumo, run
from .streets import JOIN_DISTANCE, SIDEWALK_WIDTH, StreetFile

LAYER_HEIGHT = 6.0  # metres between two layers of streets
TYPE_FILES = ("osmNetconvert.typ.xml", "osmNetconvertBicycle.typ.xml")


def convert(streets: StreetFile, source: Path, target: Path) -> Generator[Progress, None, None]:
    """Convert streets to an OpenDRIVE map.

    Parameters
    ----------
    streets : StreetFile
        What was written to ``source``.
    target : Path
        The map to write.

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
        *("--junctions.corner-detail", 5, "--osm.layer-elevation", LAYER_HEIGHT, "--output.street-names"),
        *("--no-warnings", "--xml-validation", "never", "--aggregate-warnings", 1),
    ]
    if streets.left_hand:
        options += ["--lefthand", "--opendrive-output.lefthand-left"]
    apart = sorted(
        frozenset(streets.slip_ends).union(*streets.roundabouts)
    )  # netconvert joins slip lanes of any length
    if apart:
        options += ["--junctions.join-exclude", ",".join(map(str, apart))]
    if streets.elevated:
        options += ["--osm.elevation"]
    yield from run(programs, programs.netconvert, options, "streets of the extract")
    target.write_text(_without_dates(target.read_text(encoding="utf-8"), streets), encoding="utf-8")


def _without_dates(text: str, streets: StreetFile) -> str:
    """Return a map that is the same whenever it is made, and says on which side traffic keeps.

    Names in it are escaped once: netconvert escapes them twice.
    """
    text = re.sub(r"&amp;(amp|apos|gt|lt|quot);", r"&\1;", text)
    text = re.sub(r"<!--.*?-->\s*", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'(<header [^>]*?)date="[^"]*"', r'\1date=""', text, count=1)
    return text.replace("<road ", '<road rule="LHT" ') if streets.left_hand else text
