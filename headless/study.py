"""Run a study of the program's methods.

seip study coverage scenes/junction.blend -o out/study
blender -b --python-exit-code 1 site.blend -P headless/study.py -- coverage -o out/study

`headless/studies/README.md` says what each shows and how long it takes.
"""

import importlib
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.__main__ import usage

from seip_addon.core.base.errors import SeipError

STUDIES = {
    "coverage": "coverage of sensor types × heights × numbers",
    "detection": "average precision of sensor types × numbers",
    "criteria": "placement criteria compared by what a detector finds",
    "random-sites": "random sites with traffic, to train detectors on",
    "site-training": "training of a detector on several sites",
    "open-benchmark": "placement criteria scored on ten junctions",
    "paper": "the paper's case study on its map",
    "stability": "limits of every method",
    "benchmark": "speed of visibility, placement and scans",
}
"""Studies by name: a folder each in `headless/studies`."""


def main(argv: list[str]) -> None:
    """Run the study that the first argument names, with the arguments after it."""
    if not argv or argv[0] in {"-h", "--help"}:
        runtime.print_line(usage("seip study NAME", "Run a study of the program's methods.", STUDIES))
        return
    name = argv[0]
    if name not in STUDIES:
        raise SeipError(f"there is no study {name!r}: seip study --help lists the studies")
    importlib.import_module(f"headless.studies.{name.replace('-', '_')}.command").main(argv[1:])


if __name__ == "__main__":
    runtime.run(main)
