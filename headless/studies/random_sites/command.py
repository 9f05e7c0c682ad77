"""Generate random sites with traffic, to train detectors for unseen sites.

seip study random-sites -o out/sites --sites 8 --seed 1 --runs 4 --duration 40
blender -b --python-exit-code 1 -P headless/study.py -- random-sites -o out/sites --sites 8

Needs SUMO (make sumo). Finished sites are kept: rerun the command to resume.
"""

import argparse
import time
from pathlib import Path

from headless import runtime
from headless.options import new_parser
from headless.studies.random_sites.production import MadeSite, SiteSettings, make_site

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sumo_programs import find_sumo

MAX_SITES = 9999


def main(argv: list[str]) -> None:
    """Generate the sites that do not exist yet."""
    options = _parser().parse_args(argv)
    if not 1 <= options.sites <= MAX_SITES:
        raise SeipError(f"--sites must be 1 to {MAX_SITES}, not {options.sites}")
    settings = SiteSettings(options.seed, options.runs, options.duration, options.warm_up, options.approaches)
    find_sumo()
    runtime.check_folder(options.output)
    for number in range(1, options.sites + 1):
        start = time.monotonic()
        with runtime.progress_bar() as report:
            made = finish(make_site(options.output / f"site-{number:04d}", settings, number), report)
        runtime.print_line(_describe(made, time.monotonic() - start))


def _describe(made: MadeSite, seconds: float) -> str:
    if made.kept:
        return f"{made.folder}: kept"
    plan, runs = made.record["plan"], made.record["runs"]
    arms = plan["arms"]
    steepest = max(abs(arm["slope"]) for arm in arms)
    kind = "roundabout" if plan["roundabout_m"] else "signals" if plan["signals"] else "no signals"
    side = "left" if plan["left_hand"] else "right"
    return (
        f"{made.folder}: {len(arms)} arms, {kind}, {side}-hand traffic, slopes up to {steepest:.1%}, {len(runs)} runs, "
        f"{seconds:.0f} s"
    )


def _parser() -> argparse.ArgumentParser:
    defaults = SiteSettings()
    parser = new_parser("study random-sites", "Generate random sites with traffic, to train detectors on.")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the sites, one folder each")
    parser.add_argument("--sites", type=int, default=8, metavar="N", help="number of sites; existing ones are kept")
    parser.add_argument("--seed", type=int, default=defaults.seed, metavar="N", help="seed of all randomness")
    parser.add_argument("--runs", type=int, default=defaults.runs, metavar="N", help="runs of traffic on each site")
    parser.add_argument("--duration", type=float, default=defaults.duration, metavar="S", help="duration of each run")
    parser.add_argument("--warm-up", type=float, default=defaults.warm_up, metavar="S", help="warm-up before each run")
    parser.add_argument(
        "--approaches",
        type=float,
        default=defaults.approaches,
        metavar="M",
        help="length of the streets in the regions",
    )
    return parser
