"""Generation of training sites: scene, map and runs of traffic from a seed."""

import json
from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.output.results.versions import versions
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.site.candidates import PAPER_TYPES, CandidateSettings
from seip_addon.core.site.check import check_site
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import Site
from seip_addon.core.storage.files import digest, save_json
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.workflows.traffic_runs import traffic_folder
from seip_addon.core.world.traffic_simulation.simulation import Scenario, simulate_run
from seip_addon.scene.blend_file import new_file, save_blend
from seip_addon.scene.build import build_scene
from seip_addon.scene.check import contents_of

from .demand_draw import draw_demand, draw_signals
from .extract_text import LATITUDE, LONGITUDE, write_extract, write_terrain
from .street_plan import StreetPlan, draw_plan, with_tram
from .varied_bodies import shaped

SCHEMA, VERSION = "seip.training_site", 2
APPROACHES, WARM_UP = 60.0, 80.0
"""Length of the streets in the region of interest (metres), and simulated time before a run (seconds)."""
MAX_ATTEMPTS = 8  # plans that are drawn for a site until one passes the check
_PLAN, _RUN = 0, 1  # streams of random numbers of a site


@dataclass(frozen=True)
class SiteSettings:
    """Settings of all sites.

    Parameters
    ----------
    seed : int
        Seed of all sites together.
    runs : int
        Number of runs of traffic on each site.
    duration : float, seconds
        Duration of each run.
    tram : bool
        Whether tracks of a tram lie in the main street.
    pedestrians : float, per hour and arm
        Number of pedestrians; 0 to draw it.
    """

    seed: int = 0
    runs: int = 4
    duration: float = 40.0
    tram: bool = False
    pedestrians: float = 0.0


def make_site(folder: Path, settings: SiteSettings, number: int) -> Generator[Progress, None, bool]:
    """Generate a site in a folder; return whether it was generated, not already there with the same settings.

    Its files are ``site.osm``, ``site.tif``, ``site.net.xml``, ``site.blend``, ``site_traffic/run-*.npz`` and, written
    last, ``site.json`` with the settings.

    Raises
    ------
    SeipError
        SUMO is missing, or the folder cannot be written.
    """
    find_sumo()
    record = folder / "site.json"
    key = digest(repr(settings), number, bpy.app.version_string, source_digest("headless.studies.random_sites"))
    runs = [run_path(folder, run) for run in range(1, settings.runs + 1)]
    files = [folder / "site.blend", folder / "site.net.xml", *runs]
    if _key_of(record) == key and all(file.is_file() for file in files):
        return False
    record.unlink(missing_ok=True)
    plan, geometry, attempt = yield from _built(folder, settings, number)
    for run in range(1, settings.runs + 1):
        steps = _run_of_traffic(folder, settings, [number, attempt, run], plan, geometry)
        yield from within(Progress(run, settings.runs + 1, f"run {run}"), steps)
    inputs = {"number": number, "settings": asdict(settings), "versions": versions(blender=bpy.app.version_string)}
    save_json(record, {"schema": SCHEMA, "version": VERSION, "key": key, **inputs})
    return True


def _key_of(record: Path) -> object:
    """Return the key in a site's record, or None."""
    try:
        return json.loads(record.read_text(encoding="utf-8"))["key"]
    except (OSError, ValueError, LookupError, TypeError):
        return None


def run_path(folder: Path, run: int) -> Path:
    """Return the path of a site's run of traffic; runs are numbered from 1."""
    return traffic_folder(folder / "site.blend") / f"run-{run}.npz"


def _built(
    folder: Path, settings: SiteSettings, number: int
) -> Generator[Progress, None, tuple[StreetPlan, SceneGeometry, int]]:
    """Write map and scene of the first plan that passes the check; return it, its scene, and the number rejected."""
    whole = Progress(0, settings.runs + 1, "streets")
    problems = ""
    for attempt in range(MAX_ATTEMPTS):
        plan = draw_plan(np.random.default_rng([settings.seed, number, attempt, _PLAN]))
        plan = with_tram(plan) if settings.tram else plan
        try:
            geometry = yield from within(whole, _build(folder, plan))
        except _UnusableError as error:
            problems = str(error)
            continue
        return plan, geometry, attempt
    raise SeipError(
        f"{MAX_ATTEMPTS} plans of site {number} did not pass the check of sites (the last: {problems}): "
        "choose another --seed"
    )


class _UnusableError(Exception):
    """A plan that cannot be used, with the reason."""


def _build(folder: Path, plan: StreetPlan) -> Generator[Progress, None, SceneGeometry]:
    extract, terrain = folder / "site.osm", folder / "site.tif"
    write_extract(extract, plan)
    write_terrain(terrain, plan)
    request = SiteRequest(
        near_latlon=(LATITUDE, LONGITUDE),
        approaches=APPROACHES,
        terrain=terrain,
        left_hand=plan.left_hand,
    )
    built = yield from build_site(extract, request)
    scene = new_file()
    yield from build_scene(scene, built.model, built.map_name)
    contents = contents_of(scene)
    check = yield from check_site(contents, _laid_out)
    if check.problems or contents.geometry is None:
        raise _UnusableError("; ".join(problem.text for problem in check.problems) or contents.complaint)
    save_map(built, folder / "site.net.xml")
    save_blend(folder / "site.blend")
    return contents.geometry


def _laid_out(geometry: SceneGeometry) -> tuple[Site, Sequence[str]]:
    return lay_out(geometry, SurveySettings(CandidateSettings(sensors=PAPER_TYPES))).site, ()


def _run_of_traffic(
    folder: Path, settings: SiteSettings, streams: Sequence[int], plan: StreetPlan, geometry: SceneGeometry
) -> Generator[Progress, None, None]:
    """Simulate and save a run."""
    random = np.random.default_rng([settings.seed, *streams, _RUN])
    demand, signals = draw_demand(plan, random), draw_signals(random)
    if settings.pedestrians:
        demand = replace(demand, pedestrians=settings.pedestrians)
    seed = int(random.integers(2**31))
    scenario = Scenario(demand, signals, seed, WARM_UP + settings.duration)
    simulated = yield from simulate_run(folder / "site.net.xml", scenario, WARM_UP, geometry)
    shaped(simulated.trajectories, seed).save(run_path(folder, streams[-1]))
