"""Generate random sites with traffic, to train detectors for unseen sites.

seip study random-sites -o out/sites --sites 8 --seed 1 --runs 4 --duration 40
blender -b --python-exit-code 1 -P headless/study.py -- random-sites -o out/sites --sites 8

Needs SUMO (make sumo). Finished sites are kept: rerun the command to resume.
"""

import argparse
import time
from pathlib import Path

from headless import runtime
from headless.options import new_parser, real_number, whole_number
from headless.studies.random_sites.production import SiteSettings, make_site

from seip_addon.core.base.limits import SEED, Limits
from seip_addon.core.programs.sumo_programs import find_sumo

SITES, RUNS, DURATION = Limits(1, 9999), Limits(1, 999), Limits(3.0, 3600.0)


def main(argv: list[str]) -> None:
    """Generate the sites that do not exist yet."""
    options = _parser().parse_args(argv)
    settings = SiteSettings(options.seed, options.runs, options.duration)
    find_sumo()
    runtime.check_folder(options.output)
    for number in range(1, options.sites + 1):
        start, folder = time.monotonic(), options.output / f"site-{number:04d}"
        is_new = runtime.finish_with_bar(make_site(folder, settings, number))
        runtime.print_line(f"{folder}: {f'{time.monotonic() - start:.0f} s' if is_new else 'kept'}")


def _parser() -> argparse.ArgumentParser:
    defaults = SiteSettings()
    parser = new_parser("seip study random-sites", "Generate random sites with traffic, to train detectors on.")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the sites, one folder each")
    parser.add_argument(
        "--sites", type=whole_number(SITES), default=8, metavar="N", help="number of sites; existing ones are kept"
    )
    parser.add_argument(
        "--seed", type=whole_number(SEED), default=defaults.seed, metavar="N", help="seed of all randomness"
    )
    parser.add_argument(
        "--runs", type=whole_number(RUNS), default=defaults.runs, metavar="N", help="runs of traffic on each site"
    )
    parser.add_argument(
        "--duration", type=real_number(DURATION), default=defaults.duration, metavar="S", help="duration of each run"
    )
    return parser
