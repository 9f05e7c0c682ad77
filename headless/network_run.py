"""The run of a network: surveys of its sites, allocation of the budget, and the files of each site and of the whole."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from headless.network_tasks import (
    SURVEY_FILES,
    Client,
    Failure,
    Files,
    PlaceJob,
    SolveJob,
    SurveyJob,
    run_jobs,
    solve_budget,
    survey_site,
    write_placement,
)

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.choosing.network.frontier import Frontier, SolvedBudget
from seip_addon.core.choosing.network.network_search import NetworkAllocation, Request, search_allocation
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.output.network.network_record import (
    NetworkRecord,
    NetworkSensor,
    NetworkSite,
    network_gap,
)
from seip_addon.core.storage.files import digest, save_json, whole_file
from seip_addon.core.storage.json_dataclass import as_json, from_json
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.network_sites import NetworkPlace
from seip_addon.core.workflows.survey_settings import SurveySettings

PROBLEM, SEARCHES = SURVEY_FILES[3], "searches.json"
OWN_SITE = "each sensor counts for its own site: what it sees of a neighbouring site is left out"


@dataclass(frozen=True)
class NetworkRequest:
    """Choices of a network besides its places.

    Parameters
    ----------
    budget : float, dollars
    tolerance : float
        Gap at which the search ends, as a share of the value.
    objective : Objective
        Criterion and largest number of sensors at each site.
    """

    budget: float
    tolerance: float
    approaches: float
    settings: SurveySettings
    objective: Objective


@dataclass(frozen=True)
class StoredSearches:
    """Content of ``searches.json``: budgets that earlier runs have solved."""

    key: str
    searches: tuple[SolvedBudget, ...] = ()


@dataclass
class _Site:
    """A place with its files and the searches that were made there."""

    place: NetworkPlace
    folder: Path
    key: str
    message: str = ""
    attribution: tuple[str, ...] = ()
    searches: StoredSearches = field(default_factory=lambda: StoredSearches(""))

    def problem(self) -> SiteProblem:
        """Read the placement problem."""
        return SiteProblem.load(self.folder / PROBLEM)[0]

    def found(self, budget: float, effort: float) -> SolvedBudget | None:
        """Return a search of an earlier run, if it was made."""
        same = (one for one in self.searches.searches if one.budget == budget and one.effort == effort)
        return next(same, None)

    def store(self, solved: SolvedBudget) -> None:
        """Add a search to those of the site, and write them in an order that does not depend on when they ended."""
        order = sorted((*self.searches.searches, solved), key=lambda one: (one.budget, one.effort))
        self.searches = replace(self.searches, searches=tuple(order))
        save_json(self.folder / SEARCHES, as_json(self.searches))


def run_network(
    name: str,
    places: Sequence[NetworkPlace],
    source: Callable[[NetworkPlace], tuple[str, bytes, str]],
    request: NetworkRequest,
    workers: Client,
    folder: Path,
) -> Generator[Progress, None, NetworkRecord]:
    """Survey the sites of a network, allocate the budget, and write the files of each site.

    Finished work is stored in the folders of the sites, under keys of everything that it depends on: the same call goes
    on after an interruption, and surveys only the sites that have changed.

    Parameters
    ----------
    name : str
        Name of the network.
    source : callable
        Returns suffix and content of the file that a site is built from, and the key of the site.
    folder : path
        Folder of the network, with one folder for each site.

    Raises
    ------
    SeipError
        Every site failed, or a file cannot be written.
    """
    sites = yield from _surveyed(places, source, request, workers, folder)
    good = [site for site in sites if not site.message]
    if not good:
        raise SeipError(f"all {len(sites)} sites failed; the first one: {sites[0].place.name}: {sites[0].message}")
    network = _Network(good, request, workers)
    allocation = yield from network.allocated()
    yield from _placed(good, allocation.taken, request, workers)
    rows = network.rows(allocation)
    numbers = {id(site): row for site, row in zip(good, rows, strict=True)}
    everything = tuple(numbers.get(id(site)) or _failed(site) for site in sites)
    weight = float(network.weights.sum())
    return NetworkRecord(
        name=name,
        criterion=network.criterion,
        budget_usd=allocation.budget,
        price_usd=sum(row.price_usd for row in rows),
        value=allocation.value / weight,
        bound=allocation.bound / weight,
        sites=everything,
        sensor_types=request.settings.candidates.sensors,
        sensor_names={key: model.name for key, model in request.settings.models().items()},
        attribution=tuple(sorted({credit for site in good for credit in site.attribution})),
        notes=(OWN_SITE,),
    )


def _surveyed(
    places: Sequence[NetworkPlace],
    source: Callable[[NetworkPlace], tuple[str, bytes, str]],
    request: NetworkRequest,
    workers: Client,
    folder: Path,
) -> Generator[Progress, None, list[_Site]]:
    """Survey the sites whose inputs have changed; read the others."""
    version = source_digest()
    sites: list[_Site] = []
    open_numbers: list[int] = []
    for number, place in enumerate(places):
        yield Progress(number, len(places), "looking for finished sites")
        _, _, key = source(place)
        site = _Site(place, folder / place.folder, key)
        sites.append(site)
        if not _read_survey(site, version):
            open_numbers.append(number)

    def job(number: int) -> SurveyJob:
        suffix, content, key = source(places[number])
        return SurveyJob(key, places[number], suffix, content, request.approaches, request.settings, request.objective)

    jobs = [lambda number=number: job(number) for number in open_numbers]
    done = len(sites) - len(jobs)
    yield Progress(done, len(sites), "building and surveying sites")
    for index, result in run_jobs(workers, survey_site, jobs):
        site = sites[open_numbers[index]]
        if isinstance(result, Failure):
            site.message = result.message
        else:
            _write_survey(site, result)
            if not _read_survey(site, version):
                site.message = "its files could not be read again"
        done += 1
        yield Progress(done, len(sites), "building and surveying sites")
    return sites


def _read_survey(site: _Site, version: str) -> bool:
    """Read what an earlier run has left of a site; return whether it is of the same inputs."""
    if not (site.folder / PROBLEM).is_file():
        return False
    try:
        _, header = SiteProblem.load(site.folder / PROBLEM)
    except SeipError:
        return False
    if header.get("key") != site.key:
        return False
    site.attribution = tuple(header["attribution"])
    key = digest(site.key, version)
    try:
        stored = from_json(StoredSearches, json.loads((site.folder / SEARCHES).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        stored = StoredSearches(key)
    site.searches = stored if stored.key == key else StoredSearches(key)
    return True


def _write_survey(site: _Site, files: Files) -> None:
    """Replace the files of a site; the problem comes last, so that the others belong to it."""
    shutil.rmtree(site.folder, ignore_errors=True)
    _write_files(site.folder, files, last=PROBLEM)


def _write_files(folder: Path, files: Files, last: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in sorted(files, key=lambda one: (one == last, one)):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(files[name])


class _Network:
    """Sites whose surveys succeeded, and the allocation of money to them."""

    def __init__(self, sites: Sequence[_Site], request: NetworkRequest, workers: Client) -> None:
        self._sites, self._request, self._workers = sites, request, workers
        self.weights: Float = np.array([site.place.weight for site in sites])
        self.criterion = sites[0].problem().criterion

    def allocated(self) -> Generator[Progress, None, NetworkAllocation]:
        """Allocate the budget."""
        budget, tolerance = self._request.budget, self._request.tolerance
        frontiers = [site.problem().frontier(budget) for site in self._sites]
        return (yield from search_allocation(frontiers, self.weights, budget, tolerance, self._solve, gap=self._gap))

    def rows(self, allocation: NetworkAllocation) -> list[NetworkSite]:
        """Return the sites of the record."""
        rows = []
        for site, one, frontier in zip(self._sites, allocation.taken, allocation.frontiers, strict=True):
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
            rows.append(
                NetworkSite(
                    name=place.name,
                    folder=place.folder,
                    latitude=place.latitude,
                    longitude=place.longitude,
                    weight=place.weight,
                    status="equipped" if sensors else "without sensor",
                    price_usd=sum(sensor.price_usd for sensor in sensors),
                    value=one.value,
                    bound=_bound_for(frontier, one),
                    coverage=problem.coverage(one.chosen),
                    sensors=sensors,
                )
            )
        return rows

    def _gap(self, value: float, bound: float) -> float:
        """Return the gap of weighted sums of values, as `NetworkRecord.gap` states it."""
        weight = float(self.weights.sum())
        return network_gap(self.criterion, value / weight, bound / weight)

    def _solve(self, requests: Sequence[Request]) -> Generator[Progress, None, list[SolvedBudget]]:
        """Solve budgets at the sites, on the workers or from earlier runs."""
        results = [self._sites[one.site].found(one.budget, one.effort) for one in requests]
        missing = [number for number, result in enumerate(results) if result is None]

        def job(number: int) -> SolveJob:
            one = requests[number]
            return SolveJob((self._sites[one.site].folder / PROBLEM).read_bytes(), one.budget, one.effort)

        jobs = [lambda number=number: job(number) for number in missing]
        for done, (index, result) in enumerate(run_jobs(self._workers, solve_budget, jobs), start=1):
            number = missing[index]
            site = self._sites[requests[number].site]
            if isinstance(result, Failure):
                raise SeipError(f"{site.place.name}: {result.message}")
            results[number] = result
            site.store(result)
            yield Progress(done, len(jobs), "searching placements for amounts of money", counted=False)
        return [one for one in results if one is not None]


def _placed(
    sites: Sequence[_Site], taken: Sequence[SolvedBudget], request: NetworkRequest, workers: Client
) -> Generator[Progress, None, None]:
    """Write the files of the placements that are taken, except those that an earlier run has written."""
    wanted: list[tuple[_Site, SolvedBudget, str]] = []
    for site, one in zip(sites, taken, strict=True):
        key = digest(site.key, source_digest("headless"), json.dumps(as_json(one)))
        mark = site.folder / "placed.key"
        known = mark.read_text(encoding="ascii") if mark.is_file() else ""
        if one.chosen and known == key:
            continue
        mark.unlink(missing_ok=True)
        for path in site.folder.iterdir():
            if path.name not in {*SURVEY_FILES, SEARCHES}:
                path.unlink()
        if one.chosen:
            wanted.append((site, one, key))

    def job(site: _Site, one: SolvedBudget) -> PlaceJob:
        files = {name: (site.folder / name).read_bytes() for name in SURVEY_FILES if (site.folder / name).exists()}
        objective = replace(request.objective, budget=one.price)
        return PlaceJob(files, request.settings, objective, one)

    jobs = [lambda site=site, one=one: job(site, one) for site, one, _ in wanted]
    for done, (number, result) in enumerate(run_jobs(workers, write_placement, jobs), start=1):
        site, _, key = wanted[number]
        if isinstance(result, Failure):
            raise SeipError(f"{site.place.name}: {result.message}")
        _write_files(site.folder, result, last="placement.json")
        with whole_file(site.folder / "placed.key") as temporary:
            temporary.write_text(key, encoding="ascii")
        yield Progress(done, len(jobs), "writing placements")


def _failed(site: _Site) -> NetworkSite:
    place = site.place
    return NetworkSite(
        place.name, place.folder, place.latitude, place.longitude, place.weight, "failed", message=site.message
    )


def _bound_for(frontier: Frontier, one: SolvedBudget) -> float:
    """Return the bound on the value for the money that a placement costs."""
    within = frontier.amounts <= one.price * (1 + 1e-9)
    return max(one.value, float(frontier.bounds()[within][-1]))
