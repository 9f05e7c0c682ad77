"""Growth of time and memory with the numbers of candidates, targets and triangles, each size in its own process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from headless.studies.benchmark.baselines import ours
from headless.studies.benchmark.fresh_process import alone
from headless.studies.benchmark.pareto_front import growth_exponent
from headless.studies.benchmark.resource_usage import Expense, peak_memory
from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
import pulp

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.placement.integer_program import CoverProgram
from seip_addon.core.choosing.placement.reduced_problem import make_instance
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
    """Cost against one size.

    Parameters
    ----------
    what : str
        Name of the work.
    size_of : str
        Name of the quantity that grows.
    size : tuple of float
        Sizes measured.
    seconds : tuple of float
        Processor time at each size.
    memory : tuple of float or None, MB
        Growth of the process at each size.
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
class Scaled:
    """A site with the sizes to be measured.

    Parameters
    ----------
    looked_from : int
        Number of evenly spread positions at which visibility is computed.
    stand_for : float
        Number of positions that each of them represents.
    """

    size: float
    site: Site
    looked_from: int
    stand_for: float = 1.0


def repeated(site: Site, copies: int) -> Site:
    """Repeat a site side by side along x."""
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
    scaled: Scaled, models: dict[str, LidarModel], settings: VisibilitySettings
) -> tuple[float, float | None]:
    """Compute visibility from places of a site; return the processor seconds and MB of it.

    Work done once for a site counts once; work at a position is scaled by the number of positions that it represents.
    """
    site, poses = scaled.site, scaled.site.candidates
    every = sharing_rays(poses.xyz, poses.yaw, poses.tilt)
    sample = [every[n] for n in np.unique(np.linspace(0, len(every) - 1, scaled.looked_from).astype(int))]
    longest = max(model.max_range for model in models.values())
    once, each = Expense(), Expense()

    def make() -> VisibilityModel:
        needed = needed_triangles(site.triangles, poses.xyz, site.targets.xyz, settings.delta, longest)
        caster = make_ray_caster(site.triangles, keep=needed.keep)
        return VisibilityModel(site, settings, caster)

    def work() -> None:
        model = once.time(make)
        for members in sample:
            each.time(partial(compute_rows, model, poses, models, members))

    _, memory = peak_memory(work)
    return once.cpu + each.cpu * scaled.stand_for, memory


def place(positions: int, targets: int, blocks: int, seconds: float) -> tuple[float, float | None]:
    """Place sensors in a synthetic street grid, three poses at each position; return processor seconds and MB."""
    problem = street_problem(positions, targets, blocks=blocks, count=STREET_SENSORS)
    expense = Expense()
    _, memory = peak_memory(lambda: expense.time(lambda: ours(problem, seconds)))
    return expense.cpu, memory


def visibility_growth(
    what: str, size_of: str, steps: Sequence[Scaled], models: dict[str, LidarModel], settings: VisibilitySettings
) -> Growth:
    """Measure visibility at each size."""
    found = [alone(partial(visibility_cost, step, models, settings)) for step in steps]
    return _growth(what, size_of, [step.size for step in steps], found)


def placement_growth(
    size_of: str, size: Sequence[int], steps: Sequence[tuple[int, int, int]], seconds: float
) -> Growth:
    """Measure placement in streets with the positions, targets and blocks of each step."""
    found = [alone(partial(place, *step, seconds)) for step in steps]
    return _growth(f"placement, N = {STREET_SENSORS}", size_of, size, found)


def relax(positions: int, targets: int, blocks: int) -> tuple[int, float, float | None]:
    """Solve the first linear relaxation of the program of a synthetic street grid.

    Returns
    -------
    (int, float, float or None)
        Entries of V that the exact reductions leave, processor seconds, and MB.
    """
    instance, _ = make_instance(street_problem(positions, targets, blocks=blocks, count=STREET_SENSORS))
    program = CoverProgram(instance)
    program.model.setObjective(program.covered)
    expense = Expense()
    solver = pulp.HiGHS(mip=False, msg=False, threads=1)
    _, memory = peak_memory(lambda: expense.time(lambda: program.model.solve(solver)))
    return int(np.count_nonzero(instance.visible)), expense.cpu, memory


def relaxation_growth(steps: Sequence[tuple[int, int, int]]) -> Growth:
    """Measure the first linear relaxation in streets of given positions, targets and blocks.

    `integer_program.ROOT_OPERATIONS` is ``OPERATIONS_PER_UNIT`` times the seconds, per squared entry.
    """
    found = [alone(partial(relax, *step)) for step in steps]
    entries = [entries for entries, *_ in found]
    return _growth("first linear relaxation", "entries of V", entries, [(cpu, memory) for _, cpu, memory in found])


def _growth(what: str, size_of: str, size: Sequence[float], found: Sequence[tuple[float, float | None]]) -> Growth:
    return Growth(what, size_of, tuple(size), tuple(s for s, _ in found), tuple(m for _, m in found))


def _shifted(xyz: Float, shift: Float) -> Float:
    """Return copies of points, each shifted along x."""
    return np.concatenate([xyz + np.array([dx, 0.0, 0.0]) for dx in shift])


def _repeated_candidates(candidates: Candidates, shift: Float) -> Candidates:
    copies, positions = len(shift), len(candidates.position)
    moved: dict[str, Any] = {name: _shifted(getattr(candidates, name), shift) for name in ("position", "xyz")}
    for name in ("position_name", "on_pole", "pole_source", "sensor", "height", "yaw", "tilt"):
        moved[name] = np.tile(getattr(candidates, name), copies)
    moved["position_of"] = np.concatenate([candidates.position_of + k * positions for k in range(copies)])
    moved["mandatory"] = np.tile(candidates.mandatory, (1, copies))
    return replace(candidates, **moved)
