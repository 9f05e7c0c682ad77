"""Robust placement as one job, from scenarios to deployment."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

from ..errors import SeipError
from ..placement.deployment import deploy
from ..placement.objective import CHOSEN_FOR, Objective, Solution, placement_problem, with_count
from ..progress import Progress
from ..robustness.gain_band import with_gain_band
from ..robustness.pose_study import PoseStudy, PoseStudySettings, pose_study, pose_warnings
from ..robustness.risk import Risk
from ..robustness.robust_study import RobustnessSettings, RobustStudy, robust_study
from .survey import Survey, surroundings

DRAWS_OF_KIND = 100
"""Draws with one kind of error alone, at most."""


@dataclass(frozen=True, eq=False)
class RobustSolution:
    """A robust solution with the studies that support it.

    Parameters
    ----------
    solution : Solution
        Its objective, bound and gap are those of the risk measure, as its notes say.
    study : RobustStudy
        Comparison with the nominal placement.
    pose_study : PoseStudy
        Its coverage under pose errors.
    """

    solution: Solution
    study: RobustStudy
    pose_study: PoseStudy


def check_robust_objective(objective: Objective, risk: Risk | None = None) -> None:
    """Raise SeipError where an objective asks for no most coverage, or for fewer sensors than a risk needs."""
    if objective.cheapest:
        raise SeipError(
            "a placement for what may go wrong needs a number of sensors or a budget: the least price for a coverage "
            "is of poses as planned and the empty road"
        )
    if risk is not None and objective.count is not None:
        risk.require_sensors(objective.count)


def place_robustly(
    survey: Survey, objective: Objective, settings: RobustnessSettings
) -> Generator[Progress, None, RobustSolution]:
    """Optimise a placement for pose errors, failures or multiple looks, and study the result.

    Parameters
    ----------
    objective : Objective
        Of most coverage.

    Raises
    ------
    SeipError
        As for `check_robust_objective`, `placement_problem` and `solve_robust`.
    """
    check_robust_objective(objective, settings.risk)
    site, models, visible = survey.site, survey.models, survey.grid.visible
    around, problem = surroundings(survey), placement_problem(site, visible, models, objective)
    study = yield from robust_study(around, problem, settings, [settings.risk], survey.settings.limits)
    (chosen,) = study.robust
    deployment = yield from with_gain_band(around, deploy(site, models, visible, chosen.placement.chosen))
    tried = PoseStudySettings(settings.errors, settings.draws, min(DRAWS_OF_KIND, settings.draws), settings.seed + 1)
    under_errors = yield from pose_study(around, deployment, tried)
    note = f"{CHOSEN_FOR}for {chosen.name} over {settings.scenarios} scenarios: objective, bound and gap are of that"
    notes = (note, *chosen.placement.notes, robustness_message(study), *pose_warnings(under_errors))
    solution = Solution(with_count(objective, site), replace(chosen.placement, notes=notes), None, deployment)
    return RobustSolution(solution, study, under_errors)


def robustness_message(study: RobustStudy) -> str:
    """Describe what a robust placement loses of the planned coverage, and what it saves under errors."""
    (chosen,) = study.robust
    lost, nominal = study.price(chosen), study.beside(chosen).low
    change = "less" if lost >= 0.0 else "more"
    verdict = ": this is worse" if chosen.low.value < nominal.value else ""
    return (
        f"as planned, it covers {100 * abs(lost):.2f} points {change} than the placement for poses as planned; "
        f"{chosen.evaluated_by.describe_outcome()} is at least {chosen.low.describe()} in nineteen of twenty of "
        f"{study.settings.draws} unseen draws, and {nominal.describe()} with that placement{verdict}"
    )
