"""Best placements under given spacings of targets and of candidates, evaluated on one fine grid of targets."""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from seip_addon.core.choosing.placement.deployment import weighted_share
from seip_addon.core.choosing.placement.objective import Objective, Solution, target_weights
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.lidar.model import fields_of_view
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel, visibility_model
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import Site, make_site
from seip_addon.core.workflows.placing import optimise
from seip_addon.core.workflows.survey_settings import SurveySettings

GRID_SPACINGS = (4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5)
"""Metres between targets, from coarse to fine: each halves the square that a target stands for."""

CANDIDATE_SPACINGS = (16.0, 11.0, 8.0, 5.6, 4.0, 2.8, 2.0)  # metres between posts on the pavement, from coarse to fine
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
        self._fields = fields_of_view(self._models)
        self.site = make_site(geometry, wide, spacing, settings.reach(), self._fields)
        self.weights = target_weights(self.site, objective)
        self.geometry, self._objective = geometry, objective
        self._visibility: VisibilityModel = visibility_model(self.site, settings.visibility, settings.engine)

    def answer(self, settings: SurveySettings) -> Generator[Progress, None, Answer]:
        """Find the best placement under some settings, and evaluate it."""
        site = make_site(self.geometry, settings.candidates, settings.grid_spacing, settings.reach(), self._fields)
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
