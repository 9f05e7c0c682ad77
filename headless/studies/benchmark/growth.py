"""Growth of time and memory with the numbers of candidates, targets and triangles; each size runs in a new process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from headless.studies.benchmark.baselines import ours
from headless.studies.benchmark.fresh_process import in_fresh_process
from headless.studies.benchmark.pareto_front import growth_exponent
from headless.studies.benchmark.resource_usage import Expense, peak_memory
from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
import pulp

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.integer_program import ConcaveProgram
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.chunks import compute_rows, sharing_rays
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.triangle_culling import needed_triangles
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel
from seip_addon.core.site.candidates import Candidates
from seip_addon.core.site.site import Site

STREET_SENSORS = 4


@dataclass(frozen=True, eq=False)
class Growth:
    """Cost of a task at several sizes of its input; benchmark.json holds its fields by name.

    Parameters
    ----------
    what : str
        Name of the task.
    size_of : str
        Name of the quantity that grows.
    size : tuple of float
        Values of that quantity.
    seconds : tuple of float
        Processor time at each size.
    memory : tuple of float or None, MB
        Memory that the process allocated at each size; None if it was not measured.
    """

    what: str
    size_of: str
    size: tuple[float, ...]
    seconds: tuple[float, ...]
    memory: tuple[float | None, ...]

    @property
    def time_exponent(self) -> float:
        """The exponent b in seconds ~ size**b."""
        return growth_exponent(self.size, self.seconds)

    @property
    def memory_exponent(self) -> float | None:
        """The exponent b in memory ~ size**b; None if memory was not measured."""
        known = [memory for memory in self.memory if memory]
        return growth_exponent(self.size, known) if len(known) == len(self.size) else None


@dataclass(frozen=True, eq=False)
class ScaledSite:
    """Site of one size in a series, with the sample of positions that is measured.

    Parameters
    ----------
    size : float
        Value of the quantity that grows.
    site : Site
        Site of this size.
    sample : int
        Number of evenly spread positions at which visibility is computed.
    positions_per_sample : float
        Number of positions of the site that each of them represents.
    """

    size: float
    site: Site
    sample: int
    positions_per_sample: float = 1.0


def repeated(site: Site, copies: int) -> Site:
    """Return a site that consists of copies of a site next to each other along x."""
    corners = site.triangles.reshape(-1, 3)
    pitch = float(np.ptp(corners[:, 0]))
    shift = np.arange(copies) * pitch
    targets, candidates = site.targets, site.candidates
    return replace(
        site,
        targets=replace(
            targets,
            xyz=_shifted(targets.xyz, shift),
            weight=np.tile(targets.weight, copies),
            central=np.tile(targets.central, copies),
        ),
        candidates=_repeated_candidates(candidates, shift),
        triangles=_shifted(corners, shift).reshape(-1, 3, 3),
        reflectivity=np.tile(site.reflectivity, copies),
    )


def visibility_cost(
    scaled: ScaledSite, models: dict[str, LidarModel], settings: VisibilitySettings
) -> tuple[float, float | None]:
    """Compute visibility at a sample of positions; return processor seconds and MB for the whole site.

    Work for the site as a whole is counted once. Work at a position is scaled by the number of positions that it
    represents.
    """
    site, poses = scaled.site, scaled.site.candidates
    groups = sharing_rays(poses.xyz, poses.yaw, poses.tilt)
    sample = [groups[n] for n in np.unique(np.linspace(0, len(groups) - 1, scaled.sample).astype(int))]
    longest = max(model.max_range for model in models.values())
    for_site, for_positions = Expense(), Expense()

    def make() -> VisibilityModel:
        needed = needed_triangles(site.triangles, poses.xyz, site.targets.xyz, settings.delta, longest)
        caster = make_ray_caster(site.triangles, keep=needed.keep)
        return VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)

    def work() -> None:
        model = for_site.time(make)
        for group in sample:
            for_positions.time(partial(compute_rows, model, poses, models, group))

    _, memory = peak_memory(work)
    return for_site.cpu + for_positions.cpu * scaled.positions_per_sample, memory


def placement_cost(positions: int, targets: int, blocks: int, effort: float) -> tuple[float, float | None]:
    """Optimise a placement in a street grid with three poses at each position; return processor seconds and MB."""
    problem = street_problem(positions, targets, blocks=blocks, count=STREET_SENSORS)
    expense = Expense()
    _, memory = peak_memory(lambda: expense.time(lambda: ours(problem, effort)))
    return expense.cpu, memory


def visibility_growth(
    work: str, quantity: str, steps: Sequence[ScaledSite], models: dict[str, LidarModel], settings: VisibilitySettings
) -> Growth:
    """Measure the cost of visibility at each size."""
    costs = [in_fresh_process(partial(visibility_cost, step, models, settings)) for step in steps]
    return _growth(work, quantity, [step.size for step in steps], costs)


def placement_growth(
    quantity: str, size: Sequence[int], steps: Sequence[tuple[int, int, int]], effort: float
) -> Growth:
    """Measure the cost of placement in street grids.

    Parameters
    ----------
    quantity : str
        Name of the quantity that grows.
    size : sequence of int
        Value of that quantity at each step.
    steps : sequence of (int, int, int)
        Positions, targets and blocks of the street grid at each step.
    effort : float, units of counted work
        Limit of each placement.
    """
    costs = [in_fresh_process(partial(placement_cost, *step, effort)) for step in steps]
    return _growth(f"placement, N = {STREET_SENSORS}", quantity, size, costs)


def relaxation_cost(positions: int, targets: int, blocks: int) -> tuple[int, float, float | None]:
    """Solve the linear relaxation at the root of the integer program of a synthetic street grid.

    Returns
    -------
    (int, float, float or None)
        Number of entries of A that remain after the exact reductions, processor seconds, and MB.
    """
    program = ConcaveProgram(make_instance(street_problem(positions, targets, blocks=blocks, count=STREET_SENSORS)))
    program.model.setObjective(program.objective)
    expense = Expense()
    solver = pulp.HiGHS(mip=False, msg=False, threads=1)
    _, memory = peak_memory(lambda: expense.time(lambda: program.model.solve(solver)))
    return program.entries, expense.cpu, memory


def relaxation_growth(steps: Sequence[tuple[int, int, int]]) -> Growth:
    """Measure the cost of the linear relaxation at the root, in street grids of given positions, targets and blocks.

    The constant `integer_program.ROOT_OPERATIONS` comes from this: seconds per squared entry, times
    ``OPERATIONS_PER_UNIT``.
    """
    results = [in_fresh_process(partial(relaxation_cost, *step)) for step in steps]
    entries = [entries for entries, *_ in results]
    return _growth("first linear relaxation", "entries of A", entries, [(cpu, memory) for _, cpu, memory in results])


def _growth(work: str, quantity: str, size: Sequence[float], costs: Sequence[tuple[float, float | None]]) -> Growth:
    return Growth(work, quantity, tuple(size), tuple(cpu for cpu, _ in costs), tuple(memory for _, memory in costs))


def _shifted(xyz: Float, shift: Float) -> Float:
    """Return copies of points (n, 3), each shifted along x by one of the given distances, as one array."""
    return np.concatenate([xyz + np.array([dx, 0.0, 0.0]) for dx in shift])


def _repeated_candidates(candidates: Candidates, shift: Float) -> Candidates:
    copies, positions = len(shift), len(candidates.position)
    moved: dict[str, Any] = {name: _shifted(getattr(candidates, name), shift) for name in ("position", "xyz")}
    for name in ("position_name", "on_pole", "pole_source", "sensor", "height", "yaw", "tilt"):
        moved[name] = np.tile(getattr(candidates, name), copies)
    moved["position_of"] = np.concatenate([candidates.position_of + k * positions for k in range(copies)])
    moved["mandatory"] = np.tile(candidates.mandatory, (1, copies))
    return replace(candidates, **moved)
