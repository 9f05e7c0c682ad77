"""The coarsest spacings of targets and of candidates whose answer stays within a tolerance.

An answer is the best placement under some settings; it is evaluated on a fine grid of targets, the same for all. First
the spacing of the targets is sought, then that of the candidates: from coarse to fine until the answer is as good as
that of the finest. To stop where two spacings in a row agree would be quicker, but they agree too easily: which of a
few candidates is the best is a matter of luck.
"""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.choosing.placement.deployment import weighted_share
from seip_addon.core.choosing.placement.objective import Objective, Solution, target_weights
from seip_addon.core.choosing.placement.optimisation import optimise
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.lidar.model import fields_of_view
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel, visibility_model
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import Site, make_site
from seip_addon.core.workflows.survey_settings import SurveySettings

GRID_SPACINGS = (4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5)
"""Metres between targets, from coarse to fine: each halves the square that a target stands for."""

CANDIDATE_SPACINGS = (16.0, 11.0, 8.0, 5.6, 4.0, 2.8, 2.0)  # metres between posts on the pavement, from coarse to fine
COARSE_CANDIDATE_SPACING = 8.0  # metres between posts while the spacing of the targets is sought
EVALUATION_SPACING = 0.35  # metres between the targets on which answers are evaluated
MAX_EVALUATION_TARGETS = 400_000  # targets to evaluate on; a larger place is evaluated on a coarser grid


@dataclass(frozen=True)
class Answer:
    """The best placement under some spacings, with its coverage on its own grid and on the fine one.

    Parameters
    ----------
    grid_spacing, candidate_spacing : float, metres
    targets, poses : int
        How many these lay.
    own : float
        Share of the targets' weight that it sees, on its own grid.
    evaluated : float
        The same on the fine grid.
    """

    grid_spacing: float
    candidate_spacing: float
    targets: int
    poses: int
    own: float
    evaluated: float


@dataclass(frozen=True)
class Convergence:
    """Result of the search for the coarsest spacings: all that were tried, and those picked.

    Parameters
    ----------
    settings : SurveySettings
        With the picked spacings.
    tolerance : float
        Share of the weight within which answers agree.
    by_grid, by_candidates : tuple of Answer
        What was tried, from coarse to fine; the last is the finest, with which the others are compared.
    evaluation_spacing : float, metres
        Spacing of the grid that evaluated.
    """

    settings: SurveySettings
    tolerance: float
    by_grid: tuple[Answer, ...]
    by_candidates: tuple[Answer, ...]
    evaluation_spacing: float

    @property
    def message(self) -> str:
        """The picked spacings and their coverage, as a message."""
        grid, finest = self.by_grid[-2:]
        posts, most = self.by_candidates[-2:]
        return (
            f"picked for a tolerance of {self.tolerance:g}: targets {grid.grid_spacing:g} m apart, whose placement "
            f"covers {grid.evaluated:.2%} against {finest.evaluated:.2%} with {finest.grid_spacing:g} m; "
            f"posts {posts.candidate_spacing:g} m apart, {posts.evaluated:.2%} against {most.evaluated:.2%} "
            f"with {most.candidate_spacing:g} m; all evaluated on targets {self.evaluation_spacing:g} m apart"
        )


def coarsest_settings(
    geometry: SceneGeometry, settings: SurveySettings, objective: Objective, tolerance: float
) -> Generator[Progress, None, Convergence]:
    """Find the coarsest spacings whose answer to an objective stays within a tolerance.

    Each of the two may cost half of the tolerance. A spacing of targets has to agree
    with the fine grid about the coverage of its own placement as well.

    Parameters
    ----------
    settings : SurveySettings
        Their spacings do not matter.
    tolerance : float
        Share of the weight, above 0 and below 1.

    Raises
    ------
    SeipError
        The tolerance or the objective does not suit this, or no spacing allows an answer.
    """
    if not 0 < tolerance < 1:
        raise SeipError(f"the tolerance must be a share above 0 and below 1, not {tolerance:g}")
    if objective.cheapest:
        raise SeipError("a tolerance needs a number of sensors or a budget: the coverage is not what you ask for")
    poles = {pole.name for pole in geometry.poles}
    for name in (*objective.forbidden, *objective.mandatory):
        if name not in poles:
            raise SeipError(
                f"{name!r} is not a pole: with a tolerance, posts on the pavement are renamed; "
                "draw a forbidden or mandatory area instead, or give --grid and --spacing"
            )
    evaluator = Evaluator(geometry, settings, objective)

    def answer(grid_spacing: float, candidate_spacing: float) -> Generator[Progress, None, Answer]:
        candidates = replace(settings.candidates, spacing=candidate_spacing)
        tried = replace(settings, candidates=candidates, grid_spacing=grid_spacing)
        return (yield from evaluator.answer(tried))

    share = tolerance / 2
    finest = yield from answer(GRID_SPACINGS[-1], COARSE_CANDIDATE_SPACING)
    by_grid = yield from _until_as_good(
        GRID_SPACINGS,
        lambda spacing: answer(spacing, COARSE_CANDIDATE_SPACING),
        lambda found: abs(found.own - found.evaluated) <= share and finest.evaluated - found.evaluated <= share,
        "spacing of the targets",
    )
    grid_spacing = by_grid[-1].grid_spacing
    # with more candidates a coarse grid misleads more: the finest answer is one on a finer grid, too
    most = yield from answer(max(grid_spacing / 2, GRID_SPACINGS[-1]), CANDIDATE_SPACINGS[-1])
    by_candidates = yield from _until_as_good(
        CANDIDATE_SPACINGS,
        lambda spacing: answer(grid_spacing, spacing),
        lambda found: most.evaluated - found.evaluated <= share,
        "spacing of the candidates",
    )
    candidates = replace(settings.candidates, spacing=by_candidates[-1].candidate_spacing)
    convergence = Convergence(
        settings=replace(settings, grid_spacing=grid_spacing, candidates=candidates),
        tolerance=tolerance,
        by_grid=(*by_grid, finest),
        by_candidates=(*by_candidates, most),
        evaluation_spacing=evaluator.site.targets.spacing,
    )
    reasoned = replace(convergence.settings, spacings_because=convergence.message)
    return replace(convergence, settings=reasoned)


class Evaluator:
    """Optimises under any grid settings, and evaluates the placements on one fine grid.

    Parameters
    ----------
    settings : SurveySettings
        δ and the sensor types of the evaluation.
    """

    def __init__(self, geometry: SceneGeometry, settings: SurveySettings, objective: Objective) -> None:
        spacing = max(EVALUATION_SPACING, math.sqrt(geometry.region.area / MAX_EVALUATION_TARGETS))
        wide = replace(settings.candidates, spacing=max(CANDIDATE_SPACINGS))
        self._models = settings.models()
        self.site = make_site(geometry, wide, spacing, settings.reach(), fields_of_view(self._models))
        self.weights = target_weights(self.site, objective)
        self.geometry, self._objective = geometry, objective
        self._visibility: VisibilityModel = visibility_model(self.site, settings.visibility, settings.engine)

    def answer(self, settings: SurveySettings) -> Generator[Progress, None, Answer]:
        """Find the best placement under some settings, and evaluate it."""
        site = make_site(
            self.geometry, settings.candidates, settings.grid_spacing, settings.reach(), fields_of_view(self._models)
        )
        solution = yield from self.solve(site, settings)
        seen = solution.deployment.seen_by > 0
        return Answer(
            grid_spacing=settings.grid_spacing,
            candidate_spacing=settings.candidates.spacing,
            targets=len(site.targets),
            poses=len(site.candidates),
            own=weighted_share(seen, target_weights(site, self._objective)),
            evaluated=self.evaluate(solution),
        )

    def solve(self, site: Site, settings: SurveySettings) -> Generator[Progress, None, Solution]:
        """Return the best placement on a site."""
        grid = yield from compute_visibility(site, self._models, settings.visibility, settings.engine)
        return (yield from optimise(site, grid.visible, self._models, self._objective, settings.limits))

    def evaluate(self, solution: Solution) -> float:
        """Return the share of the fine grid's weight that a placement sees."""
        seen = np.zeros(len(self.site.targets), dtype=bool)
        for sensor in solution.deployment.sensors:
            seen |= self._visibility.see(sensor.model, sensor.xyz, sensor.orientation)
        return weighted_share(seen, self.weights)


def _until_as_good(
    spacings: Sequence[float],
    answer: Callable[[float], Generator[Progress, None, Answer]],
    good: Callable[[Answer], bool],
    what: str,
) -> Generator[Progress, None, tuple[Answer, ...]]:
    """Try spacings from coarse to fine until an answer is good, or there is no finer one.

    Those too coarse for any answer, where fewer positions are left than sensors are asked for, are left out.
    """
    answers: list[Answer] = []
    for number, spacing in enumerate(spacings):
        try:
            found = yield from within(Progress(number, len(spacings), f"{what}: {spacing:g} m"), answer(spacing))
        except SeipError:
            if answers or spacing == spacings[-1]:
                raise
            continue
        answers.append(found)
        if good(found):
            break
    return tuple(answers)
