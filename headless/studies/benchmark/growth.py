"""Growth of time and memory with the size of the input; each size runs in a new process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from headless.studies.benchmark.placement import ours
from headless.studies.benchmark.resource_usage import Expense, in_fresh_process, peak_memory
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import sampled_poses

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.grid import seen_from
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel
from seip_addon.core.site.site import Site

STREET_SENSORS = 4

MeasuredCost = tuple[float, float, float | None]
"""Size, processor seconds, and MB that the process allocated; None if memory was not measured."""


@dataclass(frozen=True, eq=False)
class Growth:
    """Cost of a task at several sizes of its input.

    Parameters
    ----------
    task : str
        Name of the task.
    quantity : str
        Name of the quantity that grows.
    costs : sequence of (float, float, float or None)
        Size, processor seconds and MB at each step.
    """

    task: str
    quantity: str
    costs: Sequence[MeasuredCost]

    @property
    def time_exponent(self) -> float:
        """The exponent b in seconds ~ size**b."""
        return growth_exponent([size for size, _, _ in self.costs], [seconds for _, seconds, _ in self.costs])

    @property
    def memory_exponent(self) -> float | None:
        """The exponent b in memory ~ size**b; None if memory was not measured."""
        known = [(size, memory) for size, _, memory in self.costs if memory]
        if len(known) < len(self.costs):
            return None
        return growth_exponent([size for size, _ in known], [memory for _, memory in known])


def growth_exponent(size: Sequence[float], cost: Sequence[float]) -> float:
    """Return the exponent b of the power law cost = a · size**b, fitted by least squares of the logarithms."""
    slope, _ = np.polyfit(np.log(size), np.log(cost), 1)
    return float(slope)


def corridor_growth(
    site: Site, copies: Sequence[int], models: Mapping[str, LidarModel], settings: VisibilitySettings, samples: int
) -> Growth:
    """Measure visibility of corridors, which consist of copies of a site; samples are scaled up to all positions."""
    kilometres = float(np.ptp(site.triangles[:, :, 0])) / 1000
    positions = len(sampled_poses(site, len(site.candidates)))
    costs = []
    for number in copies:
        scale = number * positions / samples
        work = partial(visibility_cost, repeated(site, number), models, settings, samples, scale)
        costs.append((number * kilometres, *in_fresh_process(work)))
    return Growth("visibility of a corridor", "kilometres (poses, targets, triangles)", costs)


def placement_growth(quantity: str, steps: Sequence[tuple[int, tuple[int, int, int]]], effort: float) -> Growth:
    """Measure placement in synthetic street grids.

    Parameters
    ----------
    quantity : str
        Name of the quantity that grows.
    steps : sequence of (int, (int, int, int))
        Value of that quantity, and positions, targets and blocks of the street grid.
    effort : float, units of counted work
        Limit of each placement.
    """
    costs = [(size, *in_fresh_process(partial(placement_cost, *street, effort))) for size, street in steps]
    return Growth(f"placement, N = {STREET_SENSORS}", quantity, costs)


def visibility_cost(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    samples: int,
    positions_per_sample: float = 1.0,
) -> tuple[float, float | None]:
    """Compute visibility at a sample of positions; return processor seconds and MB.

    Work for the site as a whole is counted once. Work at a position is scaled by the number of positions that it
    represents.
    """
    poses = site.candidates
    for_site, for_positions = Expense(), Expense()

    def make_model() -> VisibilityModel:
        return VisibilityModel(site.targets.xyz, site.reflectivity, settings, make_ray_caster(site.triangles))

    def work() -> None:
        model = for_site.time(make_model)
        for pose in sampled_poses(site, samples):
            for_positions.time(partial(seen_from, model, poses, models, pose))

    _, memory = peak_memory(work)
    return for_site.cpu + for_positions.cpu * positions_per_sample, memory


def placement_cost(positions: int, targets: int, blocks: int, effort: float) -> tuple[float, float | None]:
    """Optimise a placement in a street grid with three poses at each position; return processor seconds and MB."""
    problem = street_problem(positions, targets, blocks=blocks, count=STREET_SENSORS)
    expense = Expense()
    _, memory = peak_memory(partial(expense.time, partial(ours, problem, effort)))
    return expense.cpu, memory


def repeated(site: Site, copies: int) -> Site:
    """Return a site that consists of copies of a site next to each other along x."""
    targets, candidates = site.targets, site.candidates
    corners = site.triangles.reshape(-1, 3)
    shift = np.arange(copies) * float(np.ptp(corners[:, 0]))
    moved: dict[str, Any] = {name: _shifted(getattr(candidates, name), shift) for name in ("position", "xyz")}
    for name in ("position_name", "on_pole", "pole_source", "sensor", "height", "yaw", "tilt"):
        moved[name] = np.tile(getattr(candidates, name), copies)
    moved["position_of"] = np.concatenate(
        [candidates.position_of + copy * len(candidates.position) for copy in range(copies)]
    )
    moved["mandatory"] = np.tile(candidates.mandatory, (1, copies))
    return replace(
        site,
        targets=replace(
            targets,
            xyz=_shifted(targets.xyz, shift),
            weight=np.tile(targets.weight, copies),
            central=np.tile(targets.central, copies),
        ),
        candidates=replace(candidates, **moved),
        triangles=_shifted(corners, shift).reshape(-1, 3, 3),
        reflectivity=np.tile(site.reflectivity, copies),
    )


def _shifted(xyz: Float, shift: Float) -> Float:
    """Return copies of points (n, 3), each shifted along x by one of the given distances, as one array."""
    return np.concatenate([xyz + np.array([dx, 0.0, 0.0]) for dx in shift])
