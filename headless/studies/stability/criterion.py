"""Sensitivity of coverage and placement to δ, grid spacings and beam azimuth.

The settings are varied one at a time. Each placement is evaluated twice: with its own settings,
and on one fine grid of targets with the requested δ, the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from seip_addon.core.arrays import Boolean, Float
from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.choosing.placement.objective import Objective, Solution
from seip_addon.core.estimates import NORMAL_QUANTILE, IntervalEstimate
from seip_addon.core.geometry.plan import surface_height
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.visibility.ray_casting import RayCaster, make_ray_caster
from seip_addon.core.sensing.visibility.ring_resolution import unresolved_from
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.site.site import Site, Targets, make_site
from seip_addon.core.workflows.survey_settings import SurveySettings

from .rows import Row
from .shares import Share
from .spacings import CANDIDATE_SPACINGS, EVALUATION_SPACING, GRID_SPACINGS, Answer, Evaluator

DELTAS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # metres

BORDER_RATIOS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Edges of bins of the distance of targets, in multiples of the border."""

POSITIONS_COUNTED = 6
"""Number of positions at which targets are counted, for each sensor type and height."""

SIGHT_CLEARANCE = 0.3
"""Metres before a target within which a line of sight may end: it may hit the road of the target itself."""


@dataclass(frozen=True)
class RingBorder:
    """Distance beyond which the rings on a level road are more than 2δ apart.

    Parameters
    ----------
    height, delta, radius : float, metres
        Height of the sensor, δ, and the distance.
    """

    sensor: str
    height: float
    delta: float
    radius: float


@dataclass(frozen=True)
class SeenByRatio:
    """Share of the targets in view that count as seen, by their distance in multiples of the border.

    Parameters
    ----------
    ratios : tuple of float
        Edges of the bins of distance.
    seen : tuple of Share or None
        Share in each bin; None for a bin without targets.
    """

    sensor: str
    ratios: tuple[float, ...]
    seen: tuple[Share | None, ...]


@dataclass(frozen=True)
class DeltaAnswer:
    """The best placement of one sensor type under one δ.

    Parameters
    ----------
    height, delta : float, metres
    coverage : float
        Coverage with this δ.
    view : float
        Share of the targets in view of its sensors: the coverage with arbitrarily dense beams.
    evaluated : float
        Coverage on the fine grid, with the requested δ.
    moved : float, metres
        Mean distance of its sensors to the nearest sensor of the placement for the requested δ.
    """

    sensor: str
    height: float
    delta: float
    coverage: float
    view: float
    evaluated: float
    moved: float


@dataclass(frozen=True, eq=False)
class Draws:
    """Coverage of one placement under random changes that should not matter.

    Parameters
    ----------
    coverage : (n,) float64
    """

    what: str
    coverage: Float

    @property
    def spread(self) -> float:
        """Standard deviation."""
        return float(self.coverage.std(ddof=1))

    @property
    def spread_interval(self) -> tuple[float, float]:
        """95 % interval of the spread, by the normal approximation of its logarithm."""
        reach = math.exp(NORMAL_QUANTILE / math.sqrt(2 * (len(self.coverage) - 1)))
        return self.spread / reach, self.spread * reach

    @property
    def settled(self) -> bool:
        """Whether the spread of half of the draws is within the interval."""
        half = self.coverage[: len(self.coverage) // 2]
        low, high = self.spread_interval
        return len(half) > 1 and low <= float(half.std(ddof=1)) <= high


@dataclass(frozen=True, eq=False)
class CriterionStudy:
    """Sensitivity of coverage and placement to the criterion of visibility.

    Parameters
    ----------
    by_grid, by_candidates : tuple of Answer
        Best placements for all values of one spacing, with the other spacing as requested.
    phase, azimuth : Draws
        Coverage of the best placement on shifted and rotated grids, and with other starting azimuths of beams.
    rechosen : Draws
        Coverage, on the fine grid, of placements optimised on such grids.
    """

    borders: tuple[RingBorder, ...]
    by_ratio: tuple[SeenByRatio, ...]
    by_delta: tuple[DeltaAnswer, ...]
    by_grid: tuple[Answer, ...]
    by_candidates: tuple[Answer, ...]
    phase: Draws
    azimuth: Draws
    rechosen: Draws


def criterion_study(
    geometry: SceneGeometry,
    settings: SurveySettings,
    count: int = 4,
    *,
    draws: int = 40,
    seed: int = 0,
) -> Generator[Progress, None, CriterionStudy]:
    """Vary δ, grid spacings and beam azimuth, one at a time.

    Parameters
    ----------
    settings : SurveySettings
        Requested settings; δ is varied for each of their sensor types, at the middle one of their heights.
    count : int
        Number of sensors.
    draws : int
        Number of random grids, and of random azimuths.
    """
    objective, random = Objective(count=count), np.random.default_rng(seed)
    models = settings.models()
    site = make_site(geometry, settings.candidates, settings.grid_spacing, fields_of_view=fields_of_view(models))
    reach = float(np.hypot(*np.ptp(site.targets.xyz[:, :2], axis=0)))
    heights = sorted(set(settings.candidates.heights))
    borders = ring_borders(models, heights, DELTAS, reach)

    yield Progress(0, 0, "targets in view and seen targets")
    by_ratio = tuple(_seen_by_ratio(site, model, settings.visibility) for model in models.values())
    by_delta: list[DeltaAnswer] = []
    for key in models:
        candidates = replace(settings.candidates, sensors=(key,), heights=(heights[len(heights) // 2],))
        by_delta += yield from _by_delta(geometry, replace(settings, candidates=candidates), objective)

    evaluator = Evaluator(geometry, settings, objective)
    by_grid = []
    for spacing in GRID_SPACINGS:
        tried = replace(settings, grid_spacing=spacing)
        by_grid.append((yield from within(Progress(0, 0, f"targets {spacing:g} m apart"), evaluator.answer(tried))))
    by_candidates = []
    for spacing in CANDIDATE_SPACINGS:
        tried = replace(settings, candidates=replace(settings.candidates, spacing=spacing))
        by_candidates.append((yield from within(Progress(0, 0, f"posts {spacing:g} m apart"), evaluator.answer(tried))))

    best = yield from evaluator.solve(site, settings)
    phase, rechosen = yield from _by_grid_laid(evaluator, site, settings, best, draws, random)
    azimuth = yield from _by_azimuth(site, settings, best.deployment, draws, random)
    return CriterionStudy(
        borders=borders,
        by_ratio=by_ratio,
        by_delta=tuple(by_delta),
        by_grid=tuple(by_grid),
        by_candidates=tuple(by_candidates),
        phase=phase,
        azimuth=azimuth,
        rechosen=rechosen,
    )


def ring_borders(
    models: dict[str, LidarModel], heights: Sequence[float], deltas: Sequence[float], reach: float
) -> tuple[RingBorder, ...]:
    """Return the distances beyond which rings on a level road are more than 2δ apart, for each type, height and δ.

    Parameters
    ----------
    reach : float, metres
        Largest distance searched.
    """
    return tuple(
        RingBorder(key, height, delta, unresolved_from(model, height, delta, min(reach, model.max_range)))
        for key, model in models.items()
        for height in heights
        for delta in deltas
    )


def in_view(caster: RayCaster, model: LidarModel, xyz: Float, orientation: Float, targets: Float) -> Boolean:
    """Return whether targets have a free line of sight to a sensor, within its range and its field of view.

    Parameters
    ----------
    xyz : (3,) float64, metres
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    targets : (t, 3) float64, metres

    Returns
    -------
    (t,) bool
    """
    way = targets - xyz
    distance = np.linalg.norm(way, axis=1)
    elevation = np.arcsin(np.clip(way @ orientation[:, 2] / distance, -1.0, 1.0))
    end, _ = caster.cast(xyz, way / distance[:, None], float(distance.max()) + 1.0)
    free: Boolean = end >= distance - SIGHT_CLEARANCE
    free &= (distance >= model.min_range) & (distance <= model.max_range)
    free &= (
        model.faces(way @ orientation) & (elevation >= model.elevations.min()) & (elevation <= model.elevations.max())
    )
    return free


def rotated_targets(geometry: SceneGeometry, spacing: float, shift: Float, angle: float) -> Targets:
    """Return a grid of targets that is shifted and rotated.

    Parameters
    ----------
    spacing : float, metres
    shift : (2,) float64
        Shift in multiples of the spacing.
    angle : float, radians
    """
    middle = np.array(geometry.region.centroid.coords[0])
    half = math.ceil(math.hypot(*np.ptp(np.reshape(geometry.region.bounds, (2, 2)), axis=0)) / spacing) + 1
    line = np.arange(-half, half + 1) * spacing
    x, y = (values.ravel() for values in np.meshgrid(line + shift[0] * spacing, line + shift[1] * spacing))
    cos, sin = math.cos(angle), math.sin(angle)
    plan = middle + np.column_stack([x * cos - y * sin, x * sin + y * cos])
    plan = plan[shapely.contains_xy(geometry.region, plan[:, 0], plan[:, 1])]
    height = surface_height(plan, joined(geometry.roads))
    xyz = np.column_stack([plan, height])[np.isfinite(height)]
    return Targets(xyz, np.ones(len(xyz)), np.zeros(len(xyz), dtype=bool), spacing)


def _seen_by_ratio(site: Site, model: LidarModel, settings: VisibilitySettings) -> SeenByRatio:
    """Count targets in view, and those seen, from upright sensors, by distance in multiples of the border."""
    caster, visibility, targets = make_ray_caster(site.triangles), visibility_model(site, settings), site.targets.xyz
    poses = site.candidates
    total, seen = np.zeros(len(BORDER_RATIOS) - 1, dtype=int), np.zeros(len(BORDER_RATIOS) - 1, dtype=int)
    upright = (poses.sensor == model.key) & (poses.tilt == 0)
    for height in np.unique(poses.height[upright]):
        own = np.flatnonzero(upright & (poses.height == height))
        for pose in own[np.linspace(0, len(own) - 1, POSITIONS_COUNTED).astype(int)]:
            xyz, orientation = poses.xyz[pose], poses.orientation(pose)
            view = in_view(caster, model, xyz, orientation, targets)
            sees = visibility.see(model, xyz, orientation) & view
            ratio = np.hypot(*(targets - xyz)[:, :2].T) / unresolved_from(model, height, settings.delta, math.inf)
            total += np.histogram(ratio[view], BORDER_RATIOS)[0]
            seen += np.histogram(ratio[sees], BORDER_RATIOS)[0]
    shares = (Share(int(s), int(t)) if t else None for s, t in zip(seen, total, strict=True))
    return SeenByRatio(model.key, BORDER_RATIOS, tuple(shares))


def _by_delta(
    geometry: SceneGeometry, settings: SurveySettings, objective: Objective
) -> Generator[Progress, None, list[DeltaAnswer]]:
    """Vary δ for one sensor type at one height."""
    evaluator = Evaluator(geometry, settings, objective)
    site = make_site(
        geometry, settings.candidates, settings.grid_spacing, fields_of_view=fields_of_view(settings.models())
    )
    caster = make_ray_caster(site.triangles, settings.engine)
    (sensor,), (height,) = settings.candidates.sensors, settings.candidates.heights
    requested = yield from within(Progress(0, 0, f"{sensor}: requested δ"), evaluator.solve(site, settings))
    answers = []
    for delta in DELTAS:
        tried = replace(settings, visibility=replace(settings.visibility, delta=delta))
        solution = yield from within(Progress(0, 0, f"{sensor}: δ = {delta:g} m"), evaluator.solve(site, tried))
        sensors = solution.deployment.sensors
        view = np.any([in_view(caster, s.model, s.xyz, s.orientation, site.targets.xyz) for s in sensors], axis=0)
        seen = solution.deployment.seen_by > 0
        moved = _moved(solution.deployment, requested.deployment)
        coverage = solution.deployment.coverage
        answers.append(
            DeltaAnswer(
                sensor, height, delta, coverage, float((view | seen).mean()), evaluator.evaluate(solution), moved
            )
        )
    return answers


def _moved(deployment: Deployment, other: Deployment) -> float:
    """Return the mean distance in plan of sensors to the nearest one of another deployment, in metres."""
    there = np.array([sensor.xyz[:2] for sensor in other.sensors])
    gaps = [np.hypot(*(there - sensor.xyz[:2]).T).min() for sensor in deployment.sensors]
    return float(np.mean(gaps))


def _by_grid_laid(
    evaluator: Evaluator,
    site: Site,
    settings: SurveySettings,
    best: Solution,
    draws: int,
    random: np.random.Generator,
) -> Generator[Progress, None, tuple[Draws, Draws]]:
    """Evaluate the best placement on shifted and rotated grids; optimise again on a quarter of them."""
    covered, rechosen = [], []
    for draw in range(draws):
        targets = rotated_targets(
            evaluator.geometry, settings.grid_spacing, random.random(2), random.uniform(0, math.pi / 2)
        )
        laid = replace(site, targets=targets)
        covered.append(_coverage(laid, settings, best.deployment))
        step = Progress(draw, draws, "shifted and rotated grids of targets")
        yield step
        if draw % 4 == 0:
            solution = yield from within(step, evaluator.solve(laid, settings))
            rechosen.append(evaluator.evaluate(solution))
    return Draws("grid phase and angle", np.array(covered)), Draws("placements on such grids", np.array(rechosen))


def _coverage(site: Site, settings: SurveySettings, deployment: Deployment, turn: Sequence[float] = ()) -> float:
    visibility = visibility_model(site, settings.visibility, settings.engine)
    turns = turn or [0.0] * len(deployment.sensors)
    seen = [
        visibility.see(sensor.model, sensor.xyz, sensor.orientation @ level_orientation(by))
        for sensor, by in zip(deployment.sensors, turns, strict=True)
    ]
    return float(np.any(seen, axis=0).mean())


def _by_azimuth(
    site: Site, settings: SurveySettings, deployment: Deployment, draws: int, random: np.random.Generator
) -> Generator[Progress, None, Draws]:
    """Evaluate with the beams of each sensor rotated by random parts of an azimuth step."""
    covered = []
    for draw in range(draws):
        yield Progress(draw, draws, "other starting azimuths of beams")
        turn = [random.uniform(0, s.model.azimuth_step) for s in deployment.sensors]
        covered.append(_coverage(site, settings, deployment, turn))
    return Draws("azimuth phase", np.array(covered))


def criterion_rows(study: CriterionStudy, delta: float) -> list[Row]:
    """Return the rows on the limits of the criterion; ``delta`` is the requested δ, in metres."""
    rows = []
    for by_ratio in study.by_ratio:
        own = [border for border in study.borders if border.sensor == by_ratio.sensor and border.delta == delta]
        inside, beyond = _around_border(by_ratio)
        rows.append(
            Row(
                method=f"visibility, {by_ratio.sensor}",
                regime=f"far targets, δ = {delta:g} m",
                begins="from " + ", ".join(f"{border.radius:.0f} m at {border.height:g} m height" for border in own),
                how=f"rings on a level road; {inside} of the targets in view within the border count as seen, "
                f"{beyond} of those beyond",
                answer="a warning with type, height and border",
            )
        )
    for by_delta in dict.fromkeys(answer.sensor for answer in study.by_delta):
        answers = [answer for answer in study.by_delta if answer.sensor == by_delta]
        least, most = answers[0], answers[-1]
        rows.append(
            Row(
                method=f"coverage, {by_delta} at {least.height:g} m",
                regime=f"δ from {least.delta:g} to {most.delta:g} m",
                begins=f"coverage rises from {least.coverage:.1%} to {most.coverage:.1%} of the targets while "
                f"{least.view:.1%} to {most.view:.1%} are in view; the placement loses at "
                f"most {100 * (max(a.evaluated for a in answers) - min(a.evaluated for a in answers)):.1f} points of "
                "coverage",
                how="best placements for each δ, evaluated with the requested δ",
                answer="the record contains δ; a warning if it is too small for the rings",
            )
        )
    for what, tried, option in (
        ("grid spacing", study.by_grid, "--grid"),
        ("candidate spacing", study.by_candidates, "--spacing"),
    ):
        finest = max(answer.evaluated for answer in tried)
        worst = min(tried, key=lambda answer: answer.evaluated)
        spacing = worst.grid_spacing if what == "grid spacing" else worst.candidate_spacing
        rows.append(
            Row(
                method="placement",
                regime=what,
                begins=f"loses up to {100 * (finest - worst.evaluated):.2f} points of coverage ({spacing:g} m)",
                how=f"best placements for each spacing, evaluated on targets {EVALUATION_SPACING:g} m apart",
                answer=f"a finer `{option}`",
            )
        )
    for draws in (study.phase, study.azimuth, study.rechosen):
        low, high = draws.spread_interval
        rows.append(
            Row(
                method="coverage",
                regime=draws.what,
                begins=f"standard deviation {IntervalEstimate(draws.spread, low, high).as_points()}",
                how=f"{len(draws.coverage)} draws"
                + ("" if draws.settled else "; half of them give a different result"),
                answer="differences of coverage below twice that are not significant",
            )
        )
    return rows


def _around_border(by_ratio: SeenByRatio) -> tuple[str, str]:
    """Return the shares that count as seen within the border and beyond it, as text."""
    inside, beyond = Share(0, 0), Share(0, 0)
    for edge, share in zip(by_ratio.ratios, by_ratio.seen, strict=False):
        if share is not None and edge < 1:
            inside += share
        elif share is not None:
            beyond += share
    within_border, beyond_border = (f"{share.value:.1%}" if share.trials else "none" for share in (inside, beyond))
    return within_border, beyond_border
