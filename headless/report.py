"""Write a report on a placement: one page of HTML and a PDF, for those who decide on it.

seip report out/
blender -b --python-exit-code 1 -P headless/report.py -- out/
"""

import argparse
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import new_parser

from seip_addon.core.output.report.evidence import load_evidence
from seip_addon.core.output.report.sections import write_report


def main(argv: list[str]) -> None:
    """Write the report into the folder of the placement."""
    options = _parser().parse_args(argv)
    load_evidence(options.folder)  # refuses a folder that is none of a placement before it is locked
    runtime.check_folder(options.folder)
    for path in runtime.finish_with_bar(write_report(options.folder)):
        runtime.print_line(str(path))


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip report", "Write a report on a placement into its folder, as HTML and PDF.")
    parser.add_argument("folder", type=Path, help="result folder of `seip place`")
    return parser


if __name__ == "__main__":
    runtime.run(main)
