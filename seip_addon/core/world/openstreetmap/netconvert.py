"""Streets of an extract as a network, made by SUMO's netconvert."""

import re
from collections.abc import Generator, Iterable
from pathlib import Path

from ...errors import SeipError
from ...progress import Progress
from ...sumo_programs import find_sumo, run
from ..traffic_simulation.street_network import read_network
from .edge_lines import moved_edges
from .network_map import PRECISION
from .street_lanes import SIDEWALK_WIDTH
from .streets import JOIN_DISTANCE, StreetFile

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
        Network to write (.net.xml).
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
    types = ",".join(str(programs.home / "data" / "typemap" / name) for name in TYPE_FILES)
    first, lines = (target.with_name(f"{target.name}.{kind}.xml") for kind in ("first", "edg"))
    common = [
        *("--no-turnarounds", "--output.street-names"),
        *("--no-warnings", "--xml-validation", "never", "--aggregate-warnings", 1),
    ]
    options: list[object] = [
        *("--osm-files", source, "--output-file", first, "--precision", 6, "--type-files", types),
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
    moved = moved_edges(read_network(first), streets.ways)
    lines.write_text("\n".join(["<edges>", *moved, "</edges>", ""]), encoding="utf-8")
    options = ["--sumo-net-file", first, "--edge-files", lines, "--output-file", target, "--precision", PRECISION]
    options += [*common, "--crossings.guess", "--junctions.corner-detail", 5, *["--lefthand"] * streets.left_hand]
    yield from run(programs, programs.netconvert, options, "lanes of the extract")
    first.unlink()
    lines.unlink()
    # The first comment holds the time of the run and the paths of its files. With it the same streets would give
    # different bytes each time, and results that carry a digest of the map would be stale.
    text = target.read_text(encoding="utf-8")
    target.write_text(re.sub(r"<!--.*?-->\s*", "", text, count=1, flags=re.DOTALL), encoding="utf-8")
