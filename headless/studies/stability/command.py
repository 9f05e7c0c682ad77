"""Find where each method begins to fail, and write the stability page with its charts.

seip study stability scenes/junction.blend -o docs
blender -b --python-exit-code 1 site.blend -P headless/study.py -- stability -o docs
"""

import argparse
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless import runtime, survey
from headless.charts import robustness as robustness_charts
from headless.studies.stability.charts import save_convergence_chart, save_delta_chart
from headless.studies.stability.criterion import criterion_rows, criterion_study
from headless.studies.stability.page import Chapter, save_page
from headless.studies.stability.robustness_rows import pose_rows, robust_rows, traffic_rows
from headless.studies.survey_options import study_parser

from seip_addon.core.base.progress import Progress
from seip_addon.core.choosing.placement.objective import DEFAULT_COUNT, Objective, check_objective, placement_problem
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.choosing.robustness.comparison import Comparison
from seip_addon.core.choosing.robustness.pose_study import pose_study
from seip_addon.core.choosing.robustness.robust_problem import RobustProblem
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.workflows.survey import Survey, surroundings
from seip_addon.core.workflows.traffic_runs import split_runs

TAIL_RISKS = (Risk(), Risk(tail=0.25), Risk(tail=0.0))
"""Risks studied over pose errors: the mean, the worst quarter and the worst scenario."""

FAILURE_RISKS = (Risk(failure="worst"), Risk(failure="mean"))


@dataclass(frozen=True)
class StabilityScope:
    """Sizes of the studies.

    Parameters
    ----------
    grids : int
        Number of random grids of targets.
    draws : (int, int)
        Number of draws of the study of pose errors, with all kinds of errors and with each single kind.
    robust, traffic : Scenarios
        Scenarios of robust placements.
    """

    grids: int = 40
    draws: tuple[int, int] = (500, 100)
    robust: Scenarios = Scenarios("pose-errors")
    traffic: Scenarios = Scenarios("traffic")


@dataclass(frozen=True, eq=False)
class StudiedScene:
    """A scene to study, with its traffic and the folder of charts.

    Parameters
    ----------
    runs : list of Trajectories
        Runs of traffic next to the scene; may be empty.
    """

    survey: Survey
    runs: list[Trajectories]
    charts: Path
    scope: StabilityScope

    @property
    def sensor(self) -> str:
        """The middle one of the sensor types, which neither covers nearly everything nor nearly nothing."""
        sensors = list(self.survey.models)
        return sensors[len(sensors) // 2]

    @property
    def placed(self) -> str:
        """Name of the placement for titles."""
        return f"{DEFAULT_COUNT} × {self.sensor}"

    def problem(self) -> PlacementProblem:
        """Return the placement problem of `DEFAULT_COUNT` sensors of that type."""
        site = self.survey.site
        problem = placement_problem(site, self.survey.grid.visible, self.survey.models, Objective(count=DEFAULT_COUNT))
        return replace(problem, forbidden=problem.forbidden | (site.candidates.sensor != self.sensor))


Work = Callable[[StudiedScene], Generator[Progress, None, Chapter]]


def main(argv: list[str], scope: StabilityScope | None = None) -> None:
    """Study all chapters, and write the page; tests pass a small ``scope``."""
    parser = study_parser("stability", "Find the limits of every method, and write a page with charts.")
    parser.add_argument("--work", type=Path, default=Path("out/stability"), help="folder for the visibility grid")
    options = parser.parse_args(argv)
    charts = options.output / "stability"
    runtime.check_folder(charts)
    surveyed, watch = survey.survey(
        argparse.Namespace(**vars(options) | {"output": options.work}),
        lambda layout: check_objective(layout.site, layout.models, Objective(count=DEFAULT_COUNT)),
    )
    origin = surveyed.geometry.origin
    runs = [Trajectories.load(path).moved_to(origin) for path in survey.runs_beside(options.scene)]
    scene = StudiedScene(surveyed, runs, charts, scope or StabilityScope())
    studies: dict[str, Work] = {"criterion": criterion, "poses": poses, "failures": failures}
    studies |= {"traffic": traffic} if len(runs) > 1 else {}
    chapters = []
    for name, study in studies.items():
        chapters.append(watch.run(name, study(scene)))
        runtime.LOG.info(f"{chapters[-1].title}: {len(chapters[-1].rows)} rows, {watch.seconds[name]:.0f} s")
    with runtime.incomplete_if_interrupted(options.output):
        save_page(options.output / "stability.md", introduction(surveyed), chapters, "stability")
    runtime.print_line(f"written to {options.output / 'stability.md'}")


def introduction(surveyed: Survey) -> str:
    """Return the introduction of the page."""
    site = surveyed.site
    return (
        "For each method: the point at which it begins to fail, how that was found, and what the program does about "
        f"it. Written by `seip study stability`: {site.name}, {len(site.targets):,} targets, "
        f"{len(site.candidates):,} poses. Brackets hold 95 % intervals. Warnings about a scene and a placement are "
        "shown in the panel and in the batch output, and stored in `placement.json`; the warning about occlusion by "
        "traffic needs an evaluation in traffic."
    )


def criterion(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Vary δ and grid spacings."""
    survey, name = scene.survey, scene.survey.site.name
    delta = survey.settings.visibility.delta
    study = yield from criterion_study(survey.geometry, survey.settings, DEFAULT_COUNT, draws=scene.scope.grids)
    save_delta_chart(scene.charts / "delta.png", study, delta, f"{name}: coverage against δ")
    save_convergence_chart(scene.charts / "convergence.png", study, f"{name}: spacings")
    return Chapter(
        "The criterion of visibility",
        criterion_rows(study, delta),
        {
            "delta.png": "Coverage of the best placement, and share of targets in view of its sensors, against δ",
            "convergence.png": "Coverage of the best placement against the spacings of targets and posts",
        },
    )


def poses(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study a placement under pose errors."""
    survey, errors = scene.survey, scene.scope.robust.pose_errors
    study = yield from _robust(scene, TAIL_RISKS)
    deployment = survey.deploy(study[0].nominal.placement.chosen)
    under_errors = yield from pose_study(surroundings(survey), deployment, errors, 0, scene.scope.draws)
    robustness_charts.save_spread_chart(scene.charts / "spread.png", study, f"{scene.placed} under pose errors")
    robustness_charts.save_loss_chart(scene.charts / "blame.png", under_errors, f"{scene.placed}: what costs coverage")
    return Chapter(
        f"Pose errors: {scene.placed}",
        (*pose_rows(under_errors), *robust_rows(study)),
        {
            "spread.png": "Distribution of coverage over unseen draws: nominal optimum and robust placements",
            "blame.png": "Mean loss with errors of only one sensor, and with only one kind of error",
        },
    )


def failures(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study placements under sensor failures."""
    study = yield from _robust(scene, FAILURE_RISKS)
    robustness_charts.save_spread_chart(scene.charts / "failures.png", study, f"{scene.placed}: failures")
    caption = "Distribution of remaining coverage over unseen draws: placements for failures and the nominal optimum"
    return Chapter(f"Failures: {scene.placed}", robust_rows(study), {"failures.png": caption})


def traffic(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study placements in traffic."""
    survey = scene.survey
    problem = RobustProblem(surroundings(survey), scene.problem(), scene.scope.traffic, split_runs(scene.runs))
    placements = yield from problem.placements([Risk()], survey.settings.limits)
    (study,) = yield from problem.compare(*placements)
    deployment = survey.deploy(study.robust.placement.chosen)
    title = f"{scene.placed} in traffic"
    robustness_charts.save_time_map(scene.charts / "time_seen.png", survey, deployment, study.robust, title)
    return Chapter(
        f"Occlusion by traffic: {scene.placed}",
        traffic_rows(study),
        {"time_seen.png": "Share of time for which each target, and the point above it, is visible in traffic"},
    )


def _robust(scene: StudiedScene, risks: Sequence[Risk]) -> Generator[Progress, None, tuple[Comparison, ...]]:
    """Optimise for risk measures, and evaluate the placements on held-out scenarios."""
    problem = RobustProblem(surroundings(scene.survey), scene.problem(), scene.scope.robust)
    placements = yield from problem.placements(risks, scene.survey.settings.limits)
    return (yield from problem.compare(*placements))
