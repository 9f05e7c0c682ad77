"""Coverage and time of three models of one LiDAR: plain range, the range equation, and beams that diverge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from headless.studies.benchmark.visibility import Cost, sampled_places
from headless.studies.full_scan import seen_by_all_rays

import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.choosing.placement.objective import Objective, check_objective, placement_problem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.estimates import RESAMPLES, IntervalEstimate, percentiles
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.chunks import compute_rows, sharing_rays
from seip_addon.core.sensing.visibility.near_surfaces import near_surfaces
from seip_addon.core.sensing.visibility.ray_casting import RayCaster, make_ray_caster
from seip_addon.core.sensing.visibility.scanning import ScanPosition
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel
from seip_addon.core.site.candidates import Candidates
from seip_addon.core.site.site import Site

PLAIN, SHIPPED, FINEST = "plain range", "range equation", "diverging beams"
"""Names of the models, from the coarsest to the finest."""

DIVERGENCE = math.radians(0.18)
"""Full width of an OS1-128's beam at half of its power, radians (first data sheet)."""

SUB_RAYS = 5

EVERY_RANGE = CarlaDropoff(attenuation=0.0, zero_intensity=0.0)
"""Law by which every return within the range is detected, and none is lost."""


@dataclass(frozen=True, eq=False)
class DivergentCaster:
    """Ray caster of diverging beams: five rays for each, one along its axis and four at the edge of its divergence.

    The range of a beam is the median of its rays' ranges, so that the majority of them decides hit or miss.

    Parameters
    ----------
    caster : RayCaster
        Caster of the single rays.
    divergence : float, radians
        Full angle between opposite rays at the edge.
    """

    caster: RayCaster
    divergence: float

    @property
    def triangles(self) -> Float:
        """The triangles that hits index, (n, 3, 3) float64, metres."""
        return self.caster.triangles

    @property
    def threads(self) -> int:
        """Number of threads that can cast at once without slowing each other down."""
        return self.caster.threads

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast beams along directions; see `RayCaster.cast`. Distances are along the axis of each beam."""
        across = np.stack([directions[:, 1], -directions[:, 0], np.zeros(len(directions))], axis=1)
        length = np.linalg.norm(across, axis=1, keepdims=True)
        across = np.where(length > 0, across / np.where(length > 0, length, 1.0), (1.0, 0.0, 0.0))
        up = np.cross(across, directions)
        cos, sin = math.cos(self.divergence / 2), math.sin(self.divergence / 2)
        edge = [cos * directions + sin * aside for aside in (across, -across, up, -up)]
        start = origin if origin.ndim == 1 else np.tile(origin, (SUB_RAYS, 1))
        distance, triangle = self.caster.cast(start, np.concatenate([directions, *edge]), max_range)
        distance, triangle = distance.reshape(SUB_RAYS, -1), triangle.reshape(SUB_RAYS, -1)
        distance[1:] *= cos
        middle = np.argsort(distance, axis=0, kind="stable")[SUB_RAYS // 2]
        beam = np.arange(len(directions))
        return distance[middle, beam], triangle[middle, beam]


@dataclass(frozen=True, eq=False)
class SensorModel:
    """One way to model a LiDAR.

    Parameters
    ----------
    divergence : float, radians
        Full angle of its beams; 0 for beams that are lines.
    """

    name: str
    lidar: LidarModel
    divergence: float = 0.0

    @property
    def rays_per_beam(self) -> int:
        """Number of rays cast for a beam."""
        return SUB_RAYS if self.divergence else 1

    def caster(self, triangles: Float) -> RayCaster:
        """Return a caster of its beams against triangles (n, 3, 3) in metres."""
        lines = make_ray_caster(triangles)
        return DivergentCaster(lines, self.divergence) if self.divergence else lines


def sensor_models(lidar: LidarModel, divergence: float = DIVERGENCE) -> tuple[SensorModel, ...]:
    """Return the three models of a LiDAR that has the range equation, the finest last.

    Parameters
    ----------
    divergence : float, radians
        Full angle of the finest model's beams.
    """
    return (
        SensorModel(PLAIN, replace(lidar, law=EVERY_RANGE)),
        SensorModel(SHIPPED, lidar),
        SensorModel(FINEST, lidar, divergence),
    )


@dataclass(frozen=True, eq=False)
class SiteFront:
    """Coverage of the same placements by each model of a site's sensors, and the cost.

    Parameters
    ----------
    poses : int
        Number of candidate poses; ``costs`` are for all of them.
    costs : mapping of str to Cost
        Cost by model; each ray of a beam counts.
    coverage : mapping of str to mapping of str to sequence of float
        Coverage of each random placement, by model and number of sensors.
    best : mapping of str to mapping of str to tuple of two float
        Coverage of the best placement by a model, by the same model and by the finest; by model and number of sensors.
    differing, compared : int
        Pairs of pose and target for which the lazy engine with diverging beams differs from casting every beam, and
        visible pairs, at the poses where both were tried.
    bare : bool
        Whether nothing at the site can block the view.
    """

    site: str
    targets: int
    poses: int
    costs: Mapping[str, Cost]
    coverage: Mapping[str, Mapping[str, Sequence[float]]]
    best: Mapping[str, Mapping[str, tuple[float, float]]]
    differing: int
    compared: int
    bare: bool = False

    def change(self, model: str, count: str | None = None, seed: int = 0) -> IntervalEstimate:
        """Return the difference of mean coverage from the finest model's, paired placement by placement.

        Parameters
        ----------
        count : str, optional
            Number of sensors; all numbers together if not given.
        seed : int
            Seed of the bootstrap over placements.
        """
        counts = list(self.coverage[model]) if count is None else [count]
        gap = np.concatenate([np.subtract(self.coverage[model][n], self.coverage[FINEST][n]) for n in counts])
        picked = np.random.default_rng(seed).integers(len(gap), size=(RESAMPLES, len(gap)))
        return IntervalEstimate(float(gap.mean()), *percentiles(gap[picked].mean(axis=1)))


@dataclass(frozen=True, eq=False)
class PrecisionFront:
    """Average precision of one detector on the same frames, scanned by each model.

    Parameters
    ----------
    placed : str
        Name of the sensor configuration.
    frames, steps : int
        Number of test frames, and of training steps on scans of the shipped model.
    costs : mapping of str to Cost
        Cost of the scans by model.
    precision, change : mapping of str to IntervalEstimate
        Average precision by model, and its change against the finest model, paired by block of traffic.
    """

    site: str
    placed: str
    frames: int
    steps: int
    costs: Mapping[str, Cost]
    precision: Mapping[str, IntervalEstimate]
    change: Mapping[str, IntervalEstimate]


@dataclass(frozen=True, eq=False)
class SensorModelFindings:
    """Findings about the models of one LiDAR type.

    Parameters
    ----------
    sensor : str
        Catalogue key.
    divergence : float, radians
    placements : int
        Number of random placements for each number of sensors.
    sites : sequence of SiteFront
    precision : PrecisionFront or None
        None if no detector was trained.
    seed : int
        Seed for placements, scans and the training.
    """

    sensor: str
    divergence: float
    placements: int
    sites: Sequence[SiteFront] = field(default_factory=tuple)
    precision: PrecisionFront | None = None
    seed: int = 0

    def over(self, earlier: SensorModelFindings | None) -> SensorModelFindings:
        """Return these findings, completed by earlier ones for the sites and the detector not measured again."""
        if earlier is None or earlier.sensor != self.sensor:
            return self
        again = {one.site: one for one in self.sites}
        sites = {one.site: again.get(one.site, one) for one in earlier.sites} | again
        return replace(self, sites=tuple(sites.values()), precision=self.precision or earlier.precision)


def random_placements(candidates: Candidates, count: int, number: int, seed: int) -> list[Integer]:
    """Return random placements, poses (count,) each: distinct positions, and a uniformly drawn pose at each.

    Parameters
    ----------
    number : int
        Number of placements.
    seed : int
        The same seed draws the same placements.
    """
    random = np.random.default_rng([seed, count])
    at = [np.flatnonzero(candidates.position_of == position) for position in np.unique(candidates.position_of)]
    return [
        np.array([random.choice(at[position]) for position in random.choice(len(at), count, replace=False)])
        for _ in range(number)
    ]


def best_placement(
    site: Site, models: Mapping[str, LidarModel], visible: Boolean, count: int, effort: float
) -> Integer:
    """Return the poses (count,) that cover the most targets by a visibility grid."""
    problem = placement_problem(site, visible, models, Objective(count=count))
    return finish(solve(problem, SolverLimits(effort=effort))).chosen


def site_front(  # noqa: PLR0913  # what is measured, and how much of it
    site: Site,
    models: Sequence[SensorModel],
    *,
    counts: Sequence[int],
    placements: int,
    checked: int,
    seed: int,
    effort: float,
) -> SiteFront:
    """Measure coverage of random placements and of the best ones by each model, pose by pose in turn.

    Parameters
    ----------
    site : Site
        Site with candidates of only the models' LiDAR.
    counts : sequence of int
        Numbers of sensors.
    placements : int
        Number of random placements for each number of sensors.
    checked : int
        Number of poses at which the lazy engine is compared with casting every diverging beam.
    seed : int
        Seed of the placements.
    effort : float, units of counted work
        Limit of each best placement.

    Raises
    ------
    SeipError
        There are fewer positions than sensors.
    """
    settings, candidates, key = VisibilitySettings(), site.candidates, models[0].lidar.key
    check_objective(site, {key: models[0].lidar}, Objective(count=max(counts)))
    targets, reflectivity = site.targets.xyz, site.reflectivity
    engines = {
        model.name: VisibilityModel(targets, reflectivity, settings, model.caster(site.triangles)) for model in models
    }
    costs = {model.name: Cost() for model in models}
    seen = {model.name: np.zeros((len(candidates), len(site.targets)), dtype=bool) for model in models}
    for poses in sharing_rays(candidates.xyz, candidates.yaw, candidates.tilt):
        for model in models:
            cost, work = costs[model.name], partial(compute_rows, engines[model.name], candidates, {key: model.lidar})
            rows = cost.expense.time(partial(work, poses))
            seen[model.name][poses] = np.unpackbits(rows.packed, axis=1, count=len(site.targets))
            cost.rays += rows.rays * model.rays_per_beam
            cost.seen += int(seen[model.name][poses].sum())

    def covered(model: str, placement: Integer) -> float:
        return float(seen[model][placement].any(axis=0).mean())

    drawn = {n: random_placements(candidates, n, placements, seed) for n in counts}
    best: dict[str, dict[str, tuple[float, float]]] = {}
    for model in models:
        chosen = {n: best_placement(site, {key: model.lidar}, seen[model.name], n, effort) for n in counts}
        best[model.name] = {str(n): (covered(model.name, one), covered(FINEST, one)) for n, one in chosen.items()}
    differing, compared = _against_every_beam(site, models[-1], settings, engines[models[-1].name], checked)
    return SiteFront(
        site.name,
        len(site.targets),
        len(candidates),
        costs,
        {model: {str(n): [covered(model, one) for one in drawn[n]] for n in counts} for model in seen},
        best,
        differing,
        compared,
    )


def _against_every_beam(
    site: Site, model: SensorModel, settings: VisibilitySettings, lazy: VisibilityModel, samples: int
) -> tuple[int, int]:
    """Return the number of pairs for which the lazy engine differs from casting every beam, and of visible pairs."""
    surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta, site.reflectivity)
    caster, candidates, wrong, seen = model.caster(site.triangles), site.candidates, 0, 0
    for poses in sampled_places(site, samples):
        origin, yaw = candidates.xyz[poses[0]], float(candidates.yaw[poses[0]])
        position = ScanPosition(caster, origin, yaw, [model.lidar], settings, site.reflectivity)
        every = seen_by_all_rays(position, surfaces)[0][0]
        wrong += int((every != lazy.see_upright([model.lidar], origin, yaw)[0][0]).sum())
        seen += int(every.sum())
    return wrong, seen
