"""Sensitivity of coverage and placement to δ and to the spacings of targets and candidates.

The settings are varied one at a time. Each placement is evaluated twice: with its own settings,
and on one fine grid of targets with the requested δ, the same for all.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.base.estimates import NORMAL_QUANTILE, IntervalEstimate
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.choosing.placement.deployment import weighted_share
from seip_addon.core.choosing.placement.objective import Objective, Solution, target_weights
from seip_addon.core.geometry.plan import surface_height
from seip_addon.core.sensing.lidar.model import LidarModel, fields_of_view
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.ray_casting import RayCaster, make_ray_caster
from seip_addon.core.sensing.visibility.ring_resolution import unresolved_from
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.site.site import Site, Targets, make_site
from seip_addon.core.workflows.placing import optimise
from seip_addon.core.workflows.survey_settings import SurveySettings

from .page import Row

DELTAS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # metres

GRID_SPACINGS = (4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5)
"""Metres between targets, from coarse to fine: each halves the square that a target stands for."""

CANDIDATE_SPACINGS = (16.0, 11.0, 8.0, 5.6, 4.0, 2.8, 2.0)  # metres between posts on the pavement, from coarse to fine
EVALUATION_SPACING = 0.35  # metres between the targets on which placements are evaluated
MAX_EVALUATION_TARGETS = 400_000  # targets to evaluate on; a larger site is evaluated on a coarser grid

POSITIONS_COUNTED = 6
"""Number of positions at which targets are counted, for each sensor type and height."""

SIGHT_CLEARANCE = 0.3
"""Metres before a target within which a line of sight may end: it may hit the road of the target itself."""


@dataclass(frozen=True)
class RingBorder:
    """Distance beyond which the rings of a type on a level road are more than 2δ apart, and what is seen around it.

    Parameters
    ----------
    radius : dict of float to float, metres
        Distance by height of the sensor.
    inside, beyond : (int, int)
        Numbers of targets in view that count as seen, and of targets in view, within that distance and beyond it.
    """

    radius: Mapping[float, float]
    inside: tuple[int, int]
    beyond: tuple[int, int]


@dataclass(frozen=True)
class DeltaAnswer:
    """The best placement of one sensor type under one δ.

    Parameters
    ----------
    delta : float, metres
    coverage : float
        Coverage with this δ.
    view : float
        Share of the targets in view of its sensors: the coverage with arbitrarily dense beams.
    evaluated : float
        Coverage on the fine grid, with the requested δ.
    """

    delta: float
    coverage: float
    view: float
    evaluated: float


@dataclass(frozen=True)
class SpacingAnswer:
    """The best placement under one spacing, with its coverage on its own grid and on the fine one.

    Parameters
    ----------
    spacing : float, metres
    own, evaluated : float
        Share of the targets' weight that it sees, on its own grid and on the fine one.
    """

    spacing: float
    own: float
    evaluated: float


@dataclass(frozen=True, eq=False)
class CriterionStudy:
    """Sensitivity of coverage and placement to the criterion of visibility.

    Parameters
    ----------
    borders : dict of str to RingBorder
        Border by sensor type.
    by_delta : dict of str to sequence of DeltaAnswer
        Best placements for all values of δ, by sensor type and height.
    by_grid, by_candidates : sequence of SpacingAnswer
        Best placements for all values of one spacing, with the other spacing as requested.
    phase : (n,) float64
        Coverage of the best placement on shifted and rotated grids.
    """

    borders: Mapping[str, RingBorder]
    by_delta: Mapping[str, Sequence[DeltaAnswer]]
    by_grid: Sequence[SpacingAnswer]
    by_candidates: Sequence[SpacingAnswer]
    phase: Float


class Evaluator:
    """Optimises under any settings, and evaluates the placements on one fine grid.

    Parameters
    ----------
    settings : SurveySettings
        δ and the sensor types of the evaluation.
    """

    def __init__(self, geometry: SceneGeometry, settings: SurveySettings, objective: Objective) -> None:
        self.geometry, self.objective = geometry, objective
        self._models = settings.models()
        spacing = max(EVALUATION_SPACING, math.sqrt(geometry.region.area / MAX_EVALUATION_TARGETS))
        wide = replace(settings.candidates, spacing=max(CANDIDATE_SPACINGS))
        self.site = make_site(geometry, wide, spacing, settings.reach(), fields_of_view(self._models))
        self._visibility = visibility_model(self.site, settings.visibility, settings.engine)

    def site_of(self, settings: SurveySettings) -> Site:
        """Return the site by some settings."""
        fields = fields_of_view(self._models)
        return make_site(self.geometry, settings.candidates, settings.grid_spacing, settings.reach(), fields)

    def solve(self, site: Site, settings: SurveySettings) -> Generator[Progress, None, Solution]:
        """Return the best placement on a site."""
        grid = yield from compute_visibility(site, self._models, settings.visibility, settings.engine)
        return (yield from optimise(site, grid.visible, self._models, self.objective, settings.limits))

    def evaluate(self, solution: Solution) -> float:
        """Return the share of the fine grid's weight that a placement sees."""
        seen = np.zeros(len(self.site.targets), dtype=bool)
        for sensor in solution.deployment.sensors:
            seen |= self._visibility.see(sensor.model, sensor.xyz, sensor.orientation)
        return weighted_share(seen, target_weights(self.site, self.objective))

    def answer(self, settings: SurveySettings, spacing: float) -> Generator[Progress, None, SpacingAnswer]:
        """Find the best placement under settings with a spacing, and evaluate it."""
        site = self.site_of(settings)
        solution = yield from within(Progress(0, 0, f"spacing of {spacing:g} m"), self.solve(site, settings))
        own = weighted_share(solution.deployment.seen_by > 0, target_weights(site, self.objective))
        return SpacingAnswer(spacing, own, self.evaluate(solution))


def criterion_study(
    geometry: SceneGeometry, settings: SurveySettings, count: int = 4, *, draws: int = 40
) -> Generator[Progress, None, CriterionStudy]:
    """Vary δ, grid spacings, and the phase and angle of the grid, one at a time.

    Parameters
    ----------
    settings : SurveySettings
        Requested settings; δ is varied for each of their sensor types, at the middle one of their heights.
    count : int
        Number of sensors.
    draws : int
        Number of random grids.
    """
    objective, candidates = Objective(count=count), settings.candidates
    evaluator = Evaluator(geometry, settings, objective)
    site = evaluator.site_of(settings)

    yield Progress(0, 0, "targets in view and seen targets")
    models = settings.models()
    borders = {key: ring_border(site, model, settings.visibility) for key, model in models.items()}
    by_delta: dict[str, list[DeltaAnswer]] = {}
    heights = sorted(set(candidates.heights))
    height = heights[len(heights) // 2]
    for key in models:
        own = replace(settings, candidates=replace(candidates, sensors=(key,), heights=(height,)))
        by_delta[f"{key} at {height:g} m"] = yield from _by_delta(Evaluator(geometry, own, objective), own)

    by_grid, by_candidates = [], []
    for spacing in GRID_SPACINGS:
        tried = replace(settings, grid_spacing=spacing)
        by_grid.append((yield from evaluator.answer(tried, spacing)))
    for spacing in CANDIDATE_SPACINGS:
        tried = replace(settings, candidates=replace(candidates, spacing=spacing))
        by_candidates.append((yield from evaluator.answer(tried, spacing)))

    best = yield from evaluator.solve(site, settings)
    random, phase = np.random.default_rng(0), []
    for draw in range(draws):
        yield Progress(draw, draws, "shifted and rotated grids of targets")
        targets = rotated_targets(geometry, settings.grid_spacing, random.random(2), random.uniform(0, math.pi / 2))
        phase.append(_coverage(replace(site, targets=targets), settings, best.deployment.sensors))
    return CriterionStudy(borders, by_delta, by_grid, by_candidates, np.array(phase))


def ring_border(site: Site, model: LidarModel, settings: VisibilitySettings) -> RingBorder:
    """Find the border of a type at each height, and count the targets in view and those seen, from upright sensors."""
    caster, visibility, targets = make_ray_caster(site.triangles), visibility_model(site, settings), site.targets.xyz
    poses = site.candidates
    upright = (poses.sensor == model.key) & (poses.tilt == 0)
    reach = min(model.max_range, float(np.hypot(*np.ptp(targets[:, :2], axis=0))))
    radius: dict[float, float] = {}
    counts = np.zeros((2, 2), dtype=int)  # within the border and beyond, seen and in view
    for height in np.unique(poses.height[upright]).tolist():
        radius[height] = unresolved_from(model, height, settings.delta, reach)
        border = unresolved_from(model, height, settings.delta, math.inf)
        own = np.flatnonzero(upright & (poses.height == height))
        for pose in own[np.linspace(0, len(own) - 1, POSITIONS_COUNTED).astype(int)]:
            xyz, orientation = poses.xyz[pose], poses.orientation(pose)
            view = in_view(caster, model, xyz, orientation, targets)
            seen = visibility.see(model, xyz, orientation) & view
            inside = np.hypot(*(targets - xyz)[:, :2].T) < border
            counts += [[(seen & part).sum(), (view & part).sum()] for part in (inside, ~inside)]
    (inside_seen, inside_view), (beyond_seen, beyond_view) = counts.tolist()
    return RingBorder(radius, (inside_seen, inside_view), (beyond_seen, beyond_view))


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
    offset = targets - xyz
    distance = np.linalg.norm(offset, axis=1)
    elevation = np.arcsin(np.clip(offset @ orientation[:, 2] / distance, -1.0, 1.0))
    end, _ = caster.cast(xyz, offset / distance[:, None], float(distance.max()) + 1.0)
    free: Boolean = end >= distance - SIGHT_CLEARANCE
    free &= (distance >= model.min_range) & (distance <= model.max_range)
    free &= model.faces(offset @ orientation)
    free &= (elevation >= model.elevations.min()) & (elevation <= model.elevations.max())
    return free


def rotated_targets(geometry: SceneGeometry, spacing: float, phase: Float, angle: float) -> Targets:
    """Return a square grid of targets on the road, shifted by parts of a spacing and rotated by an angle.

    Parameters
    ----------
    spacing : float, metres
    phase : (2,) float64, 0 to 1
    angle : float, radians
    """
    middle = np.array(geometry.region.centroid.coords[0])
    half = math.ceil(math.hypot(*np.ptp(np.reshape(geometry.region.bounds, (2, 2)), axis=0)) / spacing) + 1
    line = np.arange(-half, half + 1) * spacing
    x, y = (values.ravel() for values in np.meshgrid(line + phase[0] * spacing, line + phase[1] * spacing))
    cos, sin = math.cos(angle), math.sin(angle)
    plan = middle + np.column_stack([x * cos - y * sin, x * sin + y * cos])
    plan = plan[shapely.contains_xy(geometry.region, plan[:, 0], plan[:, 1])]
    height = surface_height(plan, joined(geometry.roads))
    xyz = np.column_stack([plan, height])[np.isfinite(height)]
    return Targets(xyz, np.ones(len(xyz)), np.zeros(len(xyz), dtype=bool), spacing)


def criterion_rows(study: CriterionStudy, delta: float) -> list[Row]:
    """Return the rows on the limits of the criterion; ``delta`` is the requested δ, in metres."""
    rows = []
    for sensor, border in study.borders.items():
        radii = ", ".join(f"{radius:.0f} m at {height:g} m height" for height, radius in border.radius.items())
        rows.append(
            Row(
                method=f"visibility, {sensor}",
                regime=f"far targets, δ = {delta:g} m",
                begins=f"from {radii}",
                how=f"rings on a level road; {_share(*border.inside)} of the targets in view within the border count "
                f"as seen, {_share(*border.beyond)} of those beyond",
                answer="a warning with type, height and border",
            )
        )
    for sensor, answers in study.by_delta.items():
        least, most, evaluated = answers[0], answers[-1], [answer.evaluated for answer in answers]
        rows.append(
            Row(
                method=f"coverage, {sensor}",
                regime=f"δ from {least.delta:g} to {most.delta:g} m",
                begins=f"coverage rises from {least.coverage:.1%} to {most.coverage:.1%} of the targets while "
                f"{least.view:.1%} to {most.view:.1%} are in view; the placement loses at most "
                f"{100 * (max(evaluated) - min(evaluated)):.1f} points of coverage",
                how="best placements for each δ, evaluated with the requested δ",
                answer="the record contains δ; a warning if it is too small for the rings",
            )
        )
    for quantity, tried, option in (
        ("grid spacing", study.by_grid, "--grid"),
        ("candidate spacing", study.by_candidates, "--spacing"),
    ):
        worst = min(tried, key=lambda answer: answer.evaluated)
        lost = max(answer.evaluated for answer in tried) - worst.evaluated
        rows.append(
            Row(
                method="placement",
                regime=quantity,
                begins=f"loses up to {100 * lost:.2f} points of coverage ({worst.spacing:g} m)",
                how=f"best placements for each spacing, evaluated on targets {EVALUATION_SPACING:g} m apart",
                answer=f"a finer `{option}`",
            )
        )
    spread = deviation(study.phase)
    rows.append(
        Row(
            method="coverage",
            regime="grid phase and angle",
            begins=f"standard deviation {spread.as_points()}",
            how=f"{len(study.phase)} draws",
            answer="differences of coverage below twice that are not significant",
        )
    )
    return rows


def deviation(values: Float) -> IntervalEstimate:
    """Estimate the standard deviation of values (n,), by the normal approximation of its logarithm."""
    spread = float(values.std(ddof=1))
    reach = math.exp(NORMAL_QUANTILE / math.sqrt(2 * (len(values) - 1)))
    return IntervalEstimate(spread, spread / reach, spread * reach)


def _by_delta(evaluator: Evaluator, settings: SurveySettings) -> Generator[Progress, None, list[DeltaAnswer]]:
    """Vary δ for one sensor type at one height."""
    site = evaluator.site_of(settings)
    caster = make_ray_caster(site.triangles, settings.engine)
    answers = []
    for delta in DELTAS:
        tried = replace(settings, visibility=replace(settings.visibility, delta=delta))
        solution = yield from within(Progress(0, 0, f"δ = {delta:g} m"), evaluator.solve(site, tried))
        sensors = solution.deployment.sensors
        view = np.any([in_view(caster, s.model, s.xyz, s.orientation, site.targets.xyz) for s in sensors], axis=0)
        view |= solution.deployment.seen_by > 0
        answers.append(
            DeltaAnswer(delta, solution.deployment.coverage, float(view.mean()), evaluator.evaluate(solution))
        )
    return answers


def _coverage(site: Site, settings: SurveySettings, sensors: Sequence[MountedSensor]) -> float:
    visibility = visibility_model(site, settings.visibility, settings.engine)
    seen = [visibility.see(sensor.model, sensor.xyz, sensor.orientation) for sensor in sensors]
    return float(np.any(seen, axis=0).mean())


def _share(part: int, whole: int) -> str:
    return f"{part / whole:.1%}" if whole else "none"
