"""Time and error of full scans, the lazy engine and simplified scans."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from headless.studies.benchmark.approximations import Approximation
from headless.studies.benchmark.resource_usage import Expense
from headless.studies.full_scan import seen_by_tilted_full_scan

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.chunks import compute_rows, sharing_rays
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.near_surfaces import near_surfaces
from seip_addon.core.sensing.visibility.ray_casting import RayCaster, make_ray_caster
from seip_addon.core.sensing.visibility.scanning import ScanPosition
from seip_addon.core.sensing.visibility.settings import Engine, VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel
from seip_addon.core.site.site import Site

ENGINES: tuple[Engine, ...] = ("bvh", "embree")

PROVEN_GAP = 1e-6  # gap below which a placement counts as optimal

SENSOR_COUNT = 4
"""Sensors of the placement in which the degradation is measured."""


@dataclass
class Cost:
    """Cost of a method to compute visibility, summed over positions.

    Parameters
    ----------
    seen : int
        Visible pairs of pose and target.
    """

    expense: Expense = field(default_factory=Expense)
    rays: int = 0
    seen: int = 0

    @property
    def seconds(self) -> float:
        """Processor time."""
        return self.expense.cpu


@dataclass(frozen=True, eq=False)
class Degradation:
    """Degradation of coverage and placement by a simplification.

    Parameters
    ----------
    wrong : float
        Wrong pairs of pose and target, per pair that is visible in the exact grid.
    claimed : float
        Coverage of the placement by the simplified grid.
    coverage : float
        Coverage of the placement by the exact grid.
    kept : int
        Number of its poses that the placement for the exact grid has as well.
    proven : bool
        Whether the placement is proven optimal on its grid; otherwise the effort was too small.
    """

    wrong: float
    claimed: float
    coverage: float
    kept: int
    proven: bool


class FullAndLazy:
    """Full and lazy visibility of a site, prepared once for all poses.

    Parameters
    ----------
    engine : {"bvh", "embree"}
    """

    def __init__(
        self, site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, engine: Engine
    ) -> None:
        self._site, self._models, self._settings = site, models, settings
        self._caster = make_ray_caster(site.triangles, engine)
        self._surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta, site.reflectivity)
        self._lazy = VisibilityModel(site.targets.xyz, site.reflectivity, settings, self._caster)

    def full(self, poses: Integer) -> tuple[Boolean, int]:
        """Cast every ray of poses at one position; return the visible targets, (k, t) bool, and the number of rays."""
        candidates = self._site.candidates
        used = [self._models[key] for key in candidates.sensor[poses].tolist()]
        origin, yaw = candidates.xyz[poses[0]], float(candidates.yaw[poses[0]])
        position = ScanPosition(self._caster, origin, yaw, used, self._settings, self._site.reflectivity)
        return seen_by_tilted_full_scan(position, float(candidates.tilt[poses[0]]), self._surfaces)

    def lazy(self, poses: Integer) -> tuple[Boolean, int]:
        """Cast only rays that can matter; see `full`."""
        rows = compute_rows(self._lazy, self._site.candidates, self._models, poses)
        return np.unpackbits(rows.packed, axis=1, count=self._lazy.targets).astype(bool), rows.rays


def sampled_places(site: Site, samples: int) -> list[Integer]:
    """Return positions evenly spread over a site, each as its poses."""
    every = sharing_rays(site.candidates.xyz, site.candidates.yaw, site.candidates.tilt)
    return [every[number] for number in np.unique(np.linspace(0, len(every) - 1, samples).astype(int))]


def visibility_costs(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    samples: int,
    simpler: Sequence[Approximation] = (),
) -> dict[str, Cost]:
    """Compute the same poses by all methods in turn: full scan and lazily, with each engine and each simplification.

    Parameters
    ----------
    samples : int
        Number of positions, evenly spread over the site.
    simpler : sequence of Approximation
        Simplifications, computed only with Embree.

    Returns
    -------
    dict of str to Cost
        Costs by scan and engine, or simplification:
        ``full bvh``, ``lazy bvh``, ``full embree``, ``lazy embree``, ``full azimuth ÷ 2``, …

    Raises
    ------
    SeipError
        A lazy result differs from its full scan.
    """
    ways = {str(engine): FullAndLazy(site, models, settings, engine) for engine in ENGINES}
    ways |= {one.name: FullAndLazy(one.site, one.models, settings, "embree") for one in simpler}
    costs = {f"{scan} {name}": Cost() for name in ways for scan in ("full", "lazy")}
    for poses in sampled_places(site, samples):
        for name, observers in ways.items():
            full = _timed(costs[f"full {name}"], observers.full, poses)
            lazy = _timed(costs[f"lazy {name}"], observers.lazy, poses)
            if (full != lazy).any():
                raise SeipError(f"pose {poses[0]}: the lazy {name} grid differs from the full scan: a defect")
    return costs


def degradations(
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    simpler: Sequence[Approximation],
    effort: float,
) -> dict[str, Degradation]:
    """Compute the degradation of grid and placement by each simplification, for four sensors of the first type.

    The grids are computed lazily; `visibility_costs` checks on a sample that they equal those of full scans.

    Returns
    -------
    dict of str to Degradation
        Degradation by name; the first is ``exact``.
    """
    exact = finish(compute_visibility(site, models, settings)).visible
    best = placed(site, models, exact, effort)
    own = best.objective / len(site.targets)
    found = {"exact": Degradation(0.0, own, own, len(best.chosen), best.gap < PROVEN_GAP)}
    for one in simpler:
        visible = finish(compute_visibility(one.site, one.models, settings)).visible
        placement = placed(one.site, models, visible, effort)
        found[one.name] = Degradation(
            wrong=float((one.on_exact_targets(visible) != exact).sum() / exact.sum()),
            claimed=placement.objective / len(one.site.targets),
            coverage=float(exact[placement.chosen].any(axis=0).mean()),
            kept=len(np.intersect1d(placement.chosen, best.chosen)),
            proven=placement.gap < PROVEN_GAP,
        )
    return found


def placed(site: Site, models: Mapping[str, LidarModel], visible: Boolean, effort: float) -> Placement:
    """Return the best placement of four sensors of the site's first type, the vanilla problem."""
    sensor = site.candidates.sensor
    problem = placement_problem(site, visible, models, Objective(count=SENSOR_COUNT))
    return finish(solve(replace(problem, forbidden=sensor != sensor[0]), SolverLimits(effort=effort)))


def cast_rate(caster: RayCaster, origin: Float, rays: int = 20_000) -> float:
    """Return the rays per second of a caster in one thread, in random directions below the horizon."""
    random = np.random.default_rng(0)
    directions = random.normal(size=(rays, 3)) * (1, 1, 0.1)
    directions[:, 2] = -np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expense = Expense()
    expense.time(lambda: caster.cast(origin, directions, 100.0))
    return rays / expense.cpu


def _timed(cost: Cost, work: Callable[[Integer], tuple[Boolean, int]], poses: Integer) -> Boolean:
    seen, rays = cost.expense.time(partial(work, poses))
    cost.rays += rays
    cost.seen += int(seen.sum())
    return seen
