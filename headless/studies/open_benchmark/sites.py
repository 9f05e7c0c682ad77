"""Junctions of the open benchmark: their description, scenes and traffic."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from headless.studies.random_sites.production import APPROACHES, SiteSettings, make_site

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.workflows.traffic_runs import traffic_folder
from seip_addon.core.workflows.traffic_simulation import SIMULATION, SimulationSettings, listed_runs, simulate_runs
from seip_addon.core.world.traffic_simulation.demand import Demand
from seip_addon.scene.blend_file import new_file, open_blend, save_blend
from seip_addon.scene.build import build_scene
from seip_addon.scene.read import read_scene

SITES = Path(__file__).with_name("sites.toml")
SEED = 2026
"""Seed of the random sites."""
RUNS, DURATION = 8, 40.0
"""Number of runs of traffic at each site, and their duration (seconds)."""


@dataclass(frozen=True)
class BenchmarkSite:
    """Junction of the benchmark.

    Parameters
    ----------
    about : str
        Description.
    extract, sha256 : str
        Name of the extract without its suffix, and its digest; "" for a random site.
    latitude, longitude : float, degrees
        Position in the extract.
    number : int
        Number of a random site; 0 for a real one.
    tram : bool
        Whether tracks of a tram are added to a random site.
    pedestrians : float, per hour and arm
        Number of pedestrians; 0 for the usual number.
    """

    name: str
    about: str
    extract: str = ""
    sha256: str = ""
    latitude: float = 0.0
    longitude: float = 0.0
    number: int = 0
    tram: bool = False
    pedestrians: float = 0.0


def read_sites() -> tuple[BenchmarkSite, ...]:
    """Read the junctions of the benchmark."""
    return tuple(BenchmarkSite(**entry) for entry in tomllib.loads(SITES.read_text(encoding="utf-8"))["site"])


def build_benchmark_site(site: BenchmarkSite, folder: Path, extracts: Path) -> Generator[Progress, None, Path]:
    """Build a site with its runs of traffic in a folder, unless it is there; return its scene.

    Parameters
    ----------
    extracts : path
        Folder with the extracts of the real sites, ``NAME.osm`` or ``NAME/input.osm``.

    Raises
    ------
    SeipError
        SUMO or an extract is missing, or an extract differs from that of the benchmark.
    """
    folder.mkdir(parents=True, exist_ok=True)
    scene = folder / "site.blend"
    if site.number:
        settings = SiteSettings(SEED, RUNS, DURATION, tram=site.tram, pedestrians=site.pedestrians)
        yield from make_site(folder, settings, site.number)
        return scene
    traffic = traffic_folder(scene)
    if scene.is_file() and len(listed_runs(traffic / SIMULATION)) == RUNS:
        return scene
    request = SiteRequest(near_latlon=(site.latitude, site.longitude), approaches=APPROACHES)
    built = yield from build_site(_extract_of(site, extracts), request)
    yield from build_scene(new_file(), built.model, built.map_name)
    save_map(built, folder / "site.net.xml")
    save_blend(scene)
    open_blend(scene)
    geometry = read_scene(bpy.context.scene).geometry
    demand = Demand(pedestrians=site.pedestrians) if site.pedestrians else Demand()
    traffic.mkdir(exist_ok=True)
    settings_of_runs = SimulationSettings(demand, duration=DURATION)
    yield from simulate_runs(folder / "site.net.xml", settings_of_runs, RUNS, geometry, traffic)
    return scene


def _extract_of(site: BenchmarkSite, extracts: Path) -> Path:
    paths = [extracts / f"{site.extract}.osm", extracts / site.extract / "input.osm"]
    path = next((one for one in paths if one.is_file()), None)
    if path is None:
        raise SeipError(f"{extracts} has no {site.extract}.osm: get it as `{SITES.name}` states")
    if hashlib.sha256(path.read_bytes()).hexdigest() != site.sha256:
        raise SeipError(f"{path} is not the file of the benchmark: its digest (SHA-256) differs from {SITES.name}")
    return path
