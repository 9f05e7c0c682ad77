"""The run of a network: surveys of its sites, allocation of the budget, and the files of each site and of the whole."""

from __future__ import annotations

import functools
import json
import shutil
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from headless.network_site import PROBLEM, SURVEY_FILES, solve_budget, survey_site, write_placement
from headless.network_workers import Client, run_jobs

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.network.frontier import Frontier, SolvedBudget
from seip_addon.core.choosing.network.network_search import Request, search_allocation
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.output.network.network_record import (
    NetworkRecord,
    NetworkSensor,
    NetworkSite,
    network_gap,
)
from seip_addon.core.sensing.visibility.ray_casting import engine_name
from seip_addon.core.storage.files import digest, save_json, whole_file
from seip_addon.core.storage.json_dataclass import as_json, from_json
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.network_sites import NetworkPlace, NetworkRequest, site_key, site_source
from seip_addon.core.world.openstreetmap.extract import Extract, read_extract
from seip_addon.core.world.openstreetmap.site import is_extract

SEARCHES, PLACED = "searches.json", "placed.key"
OWN_SITE = "each sensor counts for its own site: what it sees of a neighbouring site is left out"


@dataclass
class _Site:
    """A place with its folder, and the budgets that were solved there, in this run or an earlier one."""

    place: NetworkPlace
    folder: Path
    key: str
    message: str = ""
    attribution: tuple[str, ...] = ()
    searches: dict[tuple[float, float], SolvedBudget] = field(default_factory=dict)

    def problem(self) -> SiteProblem:
        """Read the placement problem."""
        return SiteProblem.load(self.folder / PROBLEM)[0]

    def is_surveyed(self) -> bool:
        """Read the survey and the searches in the folder; return whether they are of the same inputs."""
        try:
            _, header = SiteProblem.load(self.folder / PROBLEM)
        except SeipError:
            return False
        if header.get("key") != self.key:
            return False
        self.attribution = tuple(header["attribution"])
        try:
            stored = json.loads((self.folder / SEARCHES).read_text(encoding="utf-8"))
            solved = [from_json(SolvedBudget, one) for one in stored]
        except (OSError, ValueError, TypeError):
            solved = []
        self.searches = {(one.budget, one.effort): one for one in solved}
        return True

    def store(self, solved: SolvedBudget) -> None:
        """Add a search, and write all in an order that does not depend on when they ended."""
        self.searches[solved.budget, solved.effort] = solved
        save_json(self.folder / SEARCHES, [as_json(self.searches[key]) for key in sorted(self.searches)])


@functools.lru_cache(maxsize=2)
def extract_of(path: Path) -> Extract:
    """Return an extract; the last two are kept."""
    return finish(read_extract(path))


def run_network(
    name: str, places: Sequence[NetworkPlace], request: NetworkRequest, workers: Client, folder: Path
) -> Generator[Progress, None, NetworkRecord]:
    """Survey the sites of a network, allocate the budget, and write the files of each site.

    Finished work is stored in the folders of the sites, under keys of everything that it depends on: the same call goes
    on after an interruption, and surveys only the sites that have changed.

    Parameters
    ----------
    name : str
        Name of the network.
    folder : path
        Folder of the network, with one folder for each site.

    Raises
    ------
    SeipError
        Every site failed, or a file cannot be written.
    """
    sites = yield from _surveyed(places, request, workers, folder.resolve())
    good = [site for site in sites if not site.message]
    if not good:
        raise SeipError(f"all {len(sites)} sites failed; the first one: {sites[0].place.name}: {sites[0].message}")
    criterion = good[0].problem().criterion
    weights = np.array([site.place.weight for site in good])
    weight = float(weights.sum())

    def solve(requests: Sequence[Request]) -> Generator[Progress, None, list[SolvedBudget]]:
        return (yield from _solved(good, requests, workers))

    def gap(value: float, bound: float) -> float:
        return network_gap(criterion, value / weight, bound / weight)

    frontiers = [site.problem().frontier(request.budget) for site in good]
    allocation = yield from search_allocation(frontiers, weights, request.budget, request.tolerance, solve, gap=gap)
    yield from _placed(good, allocation.taken, request, workers)
    rows = {
        id(site): _row(site, one, frontier)
        for site, one, frontier in zip(good, allocation.taken, allocation.frontiers, strict=True)
    }
    return NetworkRecord(
        name=name,
        criterion=criterion,
        budget_usd=allocation.budget,
        price_usd=sum(row.price_usd for row in rows.values()),
        value=allocation.value / weight,
        bound=allocation.bound / weight,
        sites=tuple(rows.get(id(site)) or _failed(site) for site in sites),
        sensor_types=request.settings.candidates.sensors,
        sensor_names={key: model.name for key, model in request.settings.models().items()},
        attribution=tuple(sorted({credit for site in good for credit in site.attribution})),
        notes=(OWN_SITE,),
    )


def _surveyed(
    places: Sequence[NetworkPlace], request: NetworkRequest, workers: Client, folder: Path
) -> Generator[Progress, None, list[_Site]]:
    """Survey the sites whose inputs have changed; read the others."""
    settings, sites, missing, jobs = _key_parts(request), [], [], []
    for number, place in enumerate(places):
        yield Progress(number, len(places), "looking for finished sites")
        extract = extract_of(place.source) if is_extract(place.source) else None
        content = site_source(place, request.approaches, extract)
        site = _Site(place, folder / place.folder, site_key(place, content, *settings))
        sites.append(site)
        if site.is_surveyed():
            continue
        shutil.rmtree(site.folder, ignore_errors=True)
        site.folder.mkdir(parents=True)
        source = place.source.resolve()
        if extract is not None:
            source = site.folder / f"{source.name.split('.')[0]}.osm"
            source.write_bytes(content)
        missing.append(site)
        jobs.append((site.folder, source, place, request, site.key))
    done, what = len(sites) - len(jobs), "building and surveying sites"
    yield Progress(done, len(sites), what)
    for number, _, reason in run_jobs(workers, survey_site, jobs):
        site = missing[number]
        site.message = reason or ("" if site.is_surveyed() else "its files could not be read again")
        done += 1
        yield Progress(done, len(sites), what)
    return sites


def _key_parts(request: NetworkRequest) -> tuple[str, ...]:
    """Return what the survey of each site depends on besides its place."""
    settings, objective = request.settings, request.objective
    record = settings.as_record()
    del record["effort"]  # does not change a survey
    own = (path.read_bytes().hex() for path in settings.catalogue)
    return (
        *(json.dumps(record, sort_keys=True), *own, engine_name(settings.engine), source_digest("headless")),
        *(repr(request.approaches), objective.criterion, repr(objective.shares), repr(objective.count)),
    )


def _solved(
    sites: Sequence[_Site], requests: Sequence[Request], workers: Client
) -> Generator[Progress, None, list[SolvedBudget]]:
    """Solve budgets at sites, on the workers or from earlier runs."""
    missing = [one for one in requests if (one.budget, one.effort) not in sites[one.site].searches]
    jobs = [(sites[one.site].folder, one.budget, one.effort) for one in missing]
    for done, (number, solved, reason) in enumerate(run_jobs(workers, solve_budget, jobs), start=1):
        site = sites[missing[number].site]
        if reason:
            raise SeipError(f"{site.place.name}: {reason}")
        site.store(solved)
        yield Progress(done, len(jobs), "searching placements for amounts of money", counted=False)
    return [sites[one.site].searches[one.budget, one.effort] for one in requests]


def _placed(
    sites: Sequence[_Site], taken: Sequence[SolvedBudget], request: NetworkRequest, workers: Client
) -> Generator[Progress, None, None]:
    """Write the files of the placements that are taken, except those that an earlier run has written."""
    missing, jobs = [], []
    for site, one in zip(sites, taken, strict=True):
        key, mark = digest(site.key, json.dumps(as_json(one))), site.folder / PLACED
        if one.chosen and mark.is_file() and mark.read_text(encoding="ascii") == key:
            continue
        mark.unlink(missing_ok=True)
        for path in site.folder.iterdir():
            if path.name not in {*SURVEY_FILES, SEARCHES}:
                path.unlink()
        if one.chosen:
            missing.append((site, key))
            jobs.append((site.folder, request, one))
    for done, (number, _, reason) in enumerate(run_jobs(workers, write_placement, jobs), start=1):
        site, key = missing[number]
        if reason:
            raise SeipError(f"{site.place.name}: {reason}")
        with whole_file(site.folder / PLACED) as temporary:
            temporary.write_text(key, encoding="ascii")
        yield Progress(done, len(jobs), "writing placements")


def _row(site: _Site, one: SolvedBudget, frontier: Frontier) -> NetworkSite:
    """Return a site of the record with the placement that is taken there."""
    problem, place = site.problem(), site.place
    sensors = tuple(
        NetworkSensor(
            id=f"S{number}",
            sensor=str(problem.labels[pose]),
            latitude=float(problem.latlon[pose, 0]),
            longitude=float(problem.latlon[pose, 1]),
            height_m=round(float(problem.heights[pose]), 3),
            position=str(problem.names[pose]),
            price_usd=float(problem.prices[pose]),
        )
        for number, pose in enumerate(one.chosen, start=1)
    )
    within = frontier.amounts <= one.price * (1 + 1e-9)
    return NetworkSite(
        name=place.name,
        folder=place.folder,
        latitude=place.latitude,
        longitude=place.longitude,
        weight=place.weight,
        status="equipped" if sensors else "without sensor",
        price_usd=sum(sensor.price_usd for sensor in sensors),
        value=one.value,
        bound=max(one.value, float(frontier.bounds()[within][-1])),  # of the money that the placement costs
        coverage=problem.coverage(one.chosen),
        sensors=sensors,
    )


def _failed(site: _Site) -> NetworkSite:
    place = site.place
    return NetworkSite(
        place.name, place.folder, place.latitude, place.longitude, place.weight, "failed", message=site.message
    )
