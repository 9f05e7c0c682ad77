"""The criteria of a survey's candidate poses: those of the product, and those of the literature on the same site."""

from collections.abc import Generator, Sequence
from dataclasses import replace

from headless.detection.recordings import SampledRun

import numpy as np

from seip_addon.core.base.arrays import Integer
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.choosing.placement.concave import LOG_RETURNS
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.workflows.returns import survey_returns
from seip_addon.core.workflows.survey import Survey

from .pose_criteria import (
    InfrastructureScore,
    LogReturns,
    PoseCriterion,
    SeenShare,
    VehicleGridEntropy,
    best_by_greed,
    entropy,
    entropy_guided_visibility,
)
from .vehicle_grid import log_misses, vehicles_in
from .voxels import TrafficInstant, Voxels, seen_voxels, vehicle_occupancy, voxel_occupancy

OF_LITERATURE = ("egvs", "inspe", "pe_vgop")
CRITERIA = ("coverage", "returns", "occupancy_entropy", *OF_LITERATURE)
INSTANTS = 8  # of traffic, that hides voxels
VEHICLES = 100  # places of vehicles whose views are counted


def site_criteria(
    survey: Survey, runs: Sequence[SampledRun], keys: Sequence[str] = CRITERIA
) -> Generator[Progress, None, tuple[PoseCriterion, ...]]:
    """Compute criteria of all candidate poses: coverage and returns, and S-MIG, EGVS, InSPE and PE-VGOP.

    Coverage and returns are those that `seip place` maximises. S-MIG (Hu et al. 2022) is coverage with targets weighted
    by the entropy of whether a vehicle stands there.

    Parameters
    ----------
    survey : Survey
        Survey with one sensor type.
    runs : sequence of SampledRun
        Traffic that the criteria of the literature go by; not that of tests.
    keys : sequence of str
        Of `CRITERIA`; coverage comes first whether it is among them or not.
    """
    site, visible = survey.site, survey.grid.visible
    returns = yield from survey_returns(survey, Objective(), threads=1)
    often = vehicle_occupancy(site.targets, runs)
    literature = () if not set(keys) & set(OF_LITERATURE) else (yield from _of_literature(survey, runs))
    criteria = (
        SeenShare("coverage", "coverage", visible, np.ones(len(site.targets))),
        LogReturns(returns.in_traffic(), returns.weights),
        SeenShare("occupancy_entropy", "S-MIG", visible, entropy(often)),
        *literature,
    )
    return tuple(one for one in criteria if one.key in {"coverage", *keys})


def best_of(criterion: PoseCriterion, survey: Survey, problem: PlacementProblem) -> Generator[Progress, None, Integer]:
    """Return the poses that a criterion likes best of all candidates, (k,) ascending.

    Those of coverage, S-MIG and returns are found as `seip place` finds them, with its limit of effort; those of the
    other criteria by `best_by_greed`.
    """
    progress = Progress(0, 1, f"choose {problem.count} sensors by {criterion.name}", counted=False)
    yield progress
    limits = survey.settings.limits
    if isinstance(criterion, SeenShare) and criterion.key not in OF_LITERATURE:
        problem = replace(problem, amounts=criterion.seen, weights=criterion.weight)
    elif isinstance(criterion, LogReturns):
        problem = replace(problem, amounts=criterion.returns, weights=criterion.weight, g=LOG_RETURNS)
    else:
        return (yield from best_by_greed(criterion, problem))
    placement = yield from within(progress, solve(problem, limits))
    return np.sort(placement.chosen)


def problem_of(survey: Survey, count: int) -> PlacementProblem:
    """Return the problem of placing a number of sensors where they cover most."""
    return placement_problem(survey.site, survey.grid.visible, survey.models, Objective(count=count))


def _of_literature(survey: Survey, runs: Sequence[SampledRun]) -> Generator[Progress, None, tuple[PoseCriterion, ...]]:
    """Compute EGVS, InSPE and PE-VGOP; the rays of each pose are cast one pose after the other."""
    site, candidates = survey.site, survey.site.candidates
    voxels = Voxels.over(site.targets)
    occupancy = voxel_occupancy(voxels, runs)
    instants = [TrafficInstant.of(voxels, run.trajectories, run.trajectories.at(time)) for run, time in _instants(runs)]
    vehicles = vehicles_in(runs, site.region, VEHICLES)
    ground = ReflectiveSurface(make_ray_caster(site.triangles, survey.settings.engine), site.reflectivity)
    seen, misses = [], []
    for pose, (key, origin) in enumerate(zip(candidates.sensor.tolist(), candidates.xyz, strict=True)):
        yield Progress(pose, len(candidates), "voxels and vehicles seen")
        model, orientation = survey.models[key], candidates.orientation(pose)
        seen.append(seen_voxels(voxels, ground, instants, model, origin, orientation))
        misses.append(log_misses(ground.caster, model, origin, orientation, vehicles))
    yield Progress(len(candidates), len(candidates), "voxels and vehicles seen")
    passed, covered, free = (np.array([getattr(one, name) for one in seen]) for name in ("passed", "covered", "free"))
    unhidden = np.array([one.unhidden for one in seen]).swapaxes(0, 1)
    return (
        entropy_guided_visibility(passed, occupancy),
        InfrastructureScore(covered, free, unhidden, entropy(occupancy)),
        VehicleGridEntropy(np.array(misses)),
    )


def _instants(runs: Sequence[SampledRun]) -> list[tuple[SampledRun, float]]:
    """Return instants of runs, spread evenly over them."""
    times = [(run, time) for run in runs for time in run.times.tolist()]
    return [times[number] for number in np.linspace(0, len(times) - 1, min(INSTANTS, len(times))).astype(int).tolist()]
