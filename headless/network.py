"""Spread one budget over the junctions of a network, with a proven gap.

seip network city.osm.pbf --junctions signals --budget 2_000_000 --sensor os1_128 -o city/
seip network sites.csv --budget 500_000 --scheduler tcp://HOST:8786 -o city/
"""

import argparse
import shutil
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from headless import runtime, survey
from headless.network_run import extract_of, run_network
from headless.network_site import PROBLEM
from headless.network_workers import connected, usual_workers
from headless.options import add_settings, new_parser, real_number, whole_number

import numpy as np
import shapely

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.counts import counted, duration_text
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import LATITUDE, LONGITUDE, PRICE, SENSORS, SHARE, SITE_RADIUS, Limits
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.output.network.write import write_network
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.site.installed_cost import DEFAULTS
from seip_addon.core.storage.files import read_small
from seip_addon.core.workflows.network_sites import (
    APPROACHES,
    NetworkPlace,
    NetworkRequest,
    extract_places,
    table_places,
)
from seip_addon.core.world.openstreetmap.crossings import RULES
from seip_addon.core.world.openstreetmap.site import is_extract
from seip_addon.core.world.openstreetmap.streets import importance, is_street

MOST_SENSORS = 8
SECONDS_PER_SITE, MEMORY_PER_WORKER, DISK_PER_SITE = 20.0, 1.5, 6.0
"""Seconds of a worker, GiB and MB for a typical site; the seconds are those of `make network` on two workers."""
_MOST_BYTES = 1 << 26


def main(argv: list[str]) -> None:
    """Choose the sites, allocate the budget, and write the network."""
    options = _parser().parse_args(argv)
    if options.installed_cost is None:
        options.installed_cost = DEFAULTS
    settings = survey.read_survey_settings(options)
    settings.models()  # refuses unknown types before anything is built
    objective = Objective(count=options.count, criterion=options.criterion, shares=tuple(options.shares))
    runtime.check_folder(options.output)
    places, name = _places(options)
    request = NetworkRequest(
        budget=options.budget,
        tolerance=options.gap,
        approaches=options.approaches,
        settings=settings,
        objective=objective,
    )
    if options.scheduler is None:
        _check_sumo(places, options.output)
    number = options.workers or usual_workers()
    _state_needs(options, len(places), number)
    try:
        with connected(options.scheduler, number) as client, runtime.progress_bar() as report:
            record = finish(run_network(name, places, request, client, options.output), report)
        record = replace(record, created=datetime.now(UTC).date().isoformat())
        write_network(options.output, record, _streets(places))
    except KeyboardInterrupt as stop:
        kept = f"stopped: finished surveys and searches are kept in {options.output}; the same command resumes"
        raise KeyboardInterrupt(kept) from stop
    equipped = [site for site in record.sites if site.status == "equipped"]
    failed = [site for site in record.sites if site.status == "failed"]
    runtime.warn(f"{site.name} failed: {site.message}" for site in failed)
    sensors = sum(len(site.sensors) for site in equipped)
    where = f"{len(equipped)} of {counted(len(record.sites), 'site')}"
    runtime.print_line(f"{counted(sensors, 'sensor')} at {where}, ${record.price_usd:,.0f}")
    runtime.print_line(record.certificate)
    runtime.print_line(f"written to {options.output}/: report.html and report.pdf show the result")


def _places(options: argparse.Namespace) -> tuple[tuple[NetworkPlace, ...], str]:
    """Return the sites and the name of the network."""
    if not is_extract(options.source):
        if options.junctions or options.within:
            raise SeipError("--junctions and --within choose junctions of an extract; a table names its own sites")
        return table_places(options.source, options.approaches), options.source.stem
    within = None if options.within is None else _area(options.within)
    rules = options.junctions or ["signals"]
    places = runtime.finish_with_bar(extract_places(options.source, rules, within, options.approaches))
    return places, options.source.name.split(".")[0]


def _streets(places: Sequence[NetworkPlace]) -> list[tuple[Float, int]]:
    """Return lines and importance of the streets of the sites' extracts, for the background of the map."""
    streets = []
    for path in dict.fromkeys(place.source for place in places if is_extract(place.source)):
        extract = extract_of(path)
        for way in extract.ways.values():
            line = extract.line(way)
            if "highway" in way.tags and is_street(way.tags) and len(line) > 1:
                streets.append((np.array([(node.latitude, node.longitude) for node in line]), importance(way.tags)))
    return streets


def _area(path: Path) -> shapely.Geometry:
    """Return the area of a GeoJSON file, longitude and latitude."""
    text = read_small(path, _MOST_BYTES, "simplify it").decode("utf-8", errors="replace")
    try:
        area = shapely.union_all(shapely.get_parts(shapely.from_geojson(text)))
    except (shapely.errors.ShapelyError, ValueError) as error:
        raise SeipError(f"{path} is not GeoJSON: {error}; write it again") from error
    if area.area <= 0.0:
        raise SeipError(f"{path} holds no area: draw a polygon")
    longitude, latitude = shapely.get_coordinates(area).T
    if fault := Limits.first_fault({"a longitude": (longitude, LONGITUDE), "a latitude": (latitude, LATITUDE)}):
        raise SeipError(f"{path}: {fault}; GeoJSON has longitude before latitude, in degrees")
    return area


def _check_sumo(places: Sequence[NetworkPlace], folder: Path) -> None:
    """Refuse sites of extracts without SUMO before any site is built, unless they are surveyed already."""
    if any(is_extract(place.source) and not (folder / place.folder / PROBLEM).is_file() for place in places):
        find_sumo()


def _state_needs(options: argparse.Namespace, sites: int, number: int) -> None:
    """State what a run needs at most; refuse one for which the disk has no room."""
    disk = sites * DISK_PER_SITE / 1000.0
    free = shutil.disk_usage(options.output).free / 1e9
    if free < disk:
        raise SeipError(f"{options.output} needs about {disk:.1f} GB, and its disk has {free:.1f} GB: free some space")
    seconds, memory = sites * SECONDS_PER_SITE, number * MEMORY_PER_WORKER
    needs = f"about {duration_text(seconds / number)} on {counted(number, 'worker')}, {memory:g} GiB of memory"
    if options.scheduler is not None:
        needs = f"about {duration_text(seconds)} of one worker, {MEMORY_PER_WORKER:g} GiB for each worker"
    runtime.LOG.info(f"{counted(sites, 'site')}: {needs} and {disk:.2g} GB on the disk if none is finished")


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip network", "Spread one budget over the junctions of a network, with a proven gap.")
    parser.add_argument("source", type=Path, help="extract of OpenStreetMap, or table of sites (CSV)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    chosen = parser.add_argument_group("sites")
    chosen.add_argument(
        "--junctions",
        nargs="+",
        default=[],
        metavar="RULE",
        help=f"junctions of an extract (signals): {', '.join(RULES[:3])}, or those of a road class, such as secondary",
    )
    chosen.add_argument("--within", type=Path, metavar="GEOJSON", help="area outside which junctions are left out")
    chosen.add_argument(
        "--approaches",
        type=real_number(SITE_RADIUS),
        default=APPROACHES,
        metavar="M",
        help="length of the approaches of each junction, metres",
    )
    money = parser.add_argument_group("money")
    money.add_argument(
        "--budget", type=real_number(PRICE), required=True, metavar="USD", help="money for all sites together"
    )
    money.add_argument(
        "--count",
        type=whole_number(SENSORS),
        default=MOST_SENSORS,
        metavar="N",
        help="largest number of sensors at a site",
    )
    money.add_argument(
        "--gap",
        type=real_number(SHARE),
        default=0.01,
        metavar="SHARE",
        help="gap of the whole at which the search ends",
    )
    survey.add_survey_settings(parser)
    add_settings(parser.add_argument_group("criterion"), Objective, "criterion", "shares")
    work = parser.add_argument_group("work")
    work.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler: tcp://host:8786 or tls://host:8786")
    work.add_argument("--workers", type=whole_number(Limits(1, 1024)), metavar="N", help="processes on this machine")
    return parser


if __name__ == "__main__":
    runtime.run(main)
