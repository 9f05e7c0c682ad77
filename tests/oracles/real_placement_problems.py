"""Forty placement problems at real and shipped sites, as case studies pose them: 2 to 12 sensors, or a budget."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, placement_constraints
from seip_addon.core.sensing.returns.occlusion import returns_in_traffic
from seip_addon.core.sensing.returns.returns_grid import stored_returns
from seip_addon.core.sensing.returns.road_users import road_users
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.workflows.returns import user_weights
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.workflows.survey import lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.blend_file import new_file, open_blend
from seip_addon.scene.build import build_scene
from seip_addon.scene.read import read_scene
from tests.oracles.placement_faults import PlacementCase

ROOT = Path(__file__).resolve().parents[2]
MAPS = Path(os.environ.get("SEIP_MAPS", ROOT.parent / "shared" / "opendrive"))
EXTRACTS = MAPS.parent / "osm"
PAPER = ("type1", "type2", "type3")
MIXED = ("vlp16", "xt32", "os1_128")


@dataclass(frozen=True)
class RealSite:
    """A site with sensor types and problems; coarse ones have fewer candidates and targets than by default.

    Parameters
    ----------
    place : path and dict
        Scene, map or extract, and fields of a `SiteRequest`.
    asked : tuple of int or float
        Numbers of sensors (int) and budgets (float) of the problems there.
    """

    place: tuple[Path, dict[str, Any]]
    sensors: tuple[str, ...]
    asked: tuple[int | float, ...]
    returns: bool = False
    coarse: bool = True


def _site(source: Path, latitude: float, longitude: float) -> tuple[Path, dict[str, Any]]:
    return source, {"near_latlon": (latitude, longitude), "approaches": 60.0}


JUNCTION, CORRIDOR = (ROOT / "scenes" / "junction.blend", {}), (ROOT / "scenes" / "corridor.blend", {})
HARBOUR = ROOT / "scenes" / "harbour.osm", {"junction": ("Harbour Road", "Rope Lane")}
TOWN = ROOT / "scenes" / "town.osm", {"junction": ("Castle Street", "Market Street")}
BERLIN = _site(EXTRACTS / "neukolln.osm", 52.47391, 13.44048)
LONDON = _site(EXTRACTS / "borough_sausage_links.osm", 51.50103, -0.09301)
SEATTLE = _site(EXTRACTS / "northgate_dual_carriageway.osm", 47.70856, -122.32636)
TAIPEI = _site(EXTRACTS / "taipei.osm", 25.05217, 121.52256)
PERTH = _site(EXTRACTS / "perth_stretched_lights.osm", -31.97471, 115.89771)
TOWN01 = MAPS / "Town01.xodr", {"junction": ("26",), "approaches": 60.0}
TOWN05 = MAPS / "Town05.xodr", {"near": (-49.0, -1.0), "radius": 80.0}


SITES = {
    "junction, os1_128, returns": RealSite(JUNCTION, ("os1_128",), (4, 8), returns=True, coarse=False),
    "junction, types 1 to 3": RealSite(JUNCTION, PAPER, (4, 100_000.0), coarse=False),
    "junction, types 1 and 2": RealSite(JUNCTION, PAPER[:2], (60_000.0, 6), coarse=False),
    "junction, type 1": RealSite(JUNCTION, PAPER[:1], (8, 12), coarse=False),
    "harbour, type 2": RealSite(HARBOUR, ("type2",), (4, 7), coarse=False),
    "corridor, types 1 to 3": RealSite(CORRIDOR, PAPER, (5, 150_000.0)),
    "corridor, products, returns": RealSite(CORRIDOR, MIXED, (6, 50_000.0), returns=True),
    "Berlin, types 1 to 3": RealSite(BERLIN, PAPER, (3, 90_000.0)),
    "Berlin, os1_128, returns": RealSite(BERLIN, ("os1_128",), (2, 10), returns=True),
    "London, products, returns": RealSite(LONDON, MIXED, (7, 30_000.0), returns=True),
    "London, types 1 and 3": RealSite(LONDON, ("type1", "type3"), (4, 100_000.0)),
    "Seattle, type 2": RealSite(SEATTLE, ("type2",), (6, 10)),
    "Seattle, two products, returns": RealSite(SEATTLE, ("os0_128", "os1_128"), (3, 9), returns=True),
    "Taipei, types 1 to 3": RealSite(TAIPEI, PAPER, (5, 60_000.0)),
    "Taipei, two products, returns": RealSite(TAIPEI, ("vlp16", "pandar64"), (8, 70_000.0), returns=True),
    "Perth, two products": RealSite(PERTH, ("vlp16", "hdl64e"), (5, 50_000.0)),
    "Town05, type 1": RealSite(TOWN05, ("type1",), (8, 12)),
    "Town05, products, returns": RealSite(TOWN05, MIXED, (4, 40_000.0), returns=True),
    "Town01, types 1 to 3": RealSite(TOWN01, PAPER, (6, 45_000.0)),
    "town, two products, returns": RealSite(TOWN, ("pandar64", "xt32"), (5, 100_000.0), returns=True),
}


def real_cases(site: RealSite, folder: Path) -> list[PlacementCase]:
    """Build a site, compute its visibility or returns, and return its problems."""
    source, request = site.place
    if source.suffix == ".blend":
        open_blend(source)
    else:
        built = finish(build_site(source, SiteRequest(**request), folder / "site.xodr"))
        finish(build_scene(new_file(), built.model, built.map_name))
    reading = read_scene(bpy.context.scene)
    candidates = CandidateSettings(sensors=site.sensors)
    if site.coarse:
        candidates = replace(candidates, heights=(5.4, 8.0), spacing=6.0)
    settings = SurveySettings(candidates, grid_spacing=2.0 if site.coarse else 1.0)
    layout = lay_out(reading.geometry, settings, reading.warnings)
    constraints = placement_constraints(layout.site, layout.models, Objective(count=1))
    amounts, weights = _amounts(layout, folder, returns=site.returns), constraints.weights
    if site.returns:
        weights = user_weights(road_users(layout.geometry), Objective(count=1))
    number = len(amounts)
    case = PlacementCase(
        amounts=amounts,
        logarithm=site.returns,
        weights=weights,
        prices=constraints.prices,
        positions=constraints.positions,
        xyz=constraints.xyz,
        labels=constraints.labels,
        mandatory=np.zeros((0, number), bool),
        forbidden=np.zeros(number, bool),
    )
    return [
        replace(case, count=limit) if isinstance(limit, int) else replace(case, budget=limit) for limit in site.asked
    ]


def _amounts(layout, folder, *, returns):
    if not returns:
        return finish(see(layout, folder / "visibility.npz")).grid.visible
    users = road_users(layout.geometry)
    grid = finish(stored_returns(None, layout.site, users, layout.models))
    return returns_in_traffic(grid.returns, layout.site.candidates.xyz, users)
