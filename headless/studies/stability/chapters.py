"""Chapters of the stability page, each on the limits of one method."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from headless.charts import robustness as robustness_charts

from seip_addon.core.choosing.placement.objective import DEFAULT_COUNT, Objective, placement_problem
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.choosing.robustness.comparison import Comparison
from seip_addon.core.choosing.robustness.pose_study import pose_study
from seip_addon.core.choosing.robustness.robust_problem import RobustProblem
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.workflows.survey import Survey, surroundings
from seip_addon.core.workflows.traffic_runs import split_runs

from . import charts as limits_charts
from .arithmetic import arithmetic_rows, arithmetic_study
from .criterion import criterion_rows, criterion_study
from .page import Chapter, Chart
from .robustness_rows import pose_rows, robust_rows, traffic_rows
from .weather import untouched_types, weather_rows, weather_study

TAIL_RISKS = (Risk(), Risk(tail=0.25), Risk(tail=0.0))
"""Risks studied over pose errors: the mean, the worst quarter and the worst scenario."""

RISKS = (Risk(failure="worst"), Risk(failure="mean"))
"""Risks studied: failure of a sensor."""

CHAPTERS = ("criterion", "arithmetic", "poses", "failures", "traffic", "weather")
"""Names of the chapters, in the order of the page."""


@dataclass(frozen=True)
class StabilityScope:
    """Sizes of the studies.

    Parameters
    ----------
    grids : int
        Number of random grids of targets, and of random azimuths.
    rays : int
        Number of rays compared with float64 on each scene.
    draws : (int, int)
        Number of draws of the study of pose errors, with all kinds of errors and with each single kind.
    robust, traffic : Scenarios
        Scenarios of robust placements.
    """

    grids: int = 40
    rays: int = 20_000
    draws: tuple[int, int] = (500, 100)
    robust: Scenarios = Scenarios("pose-errors")
    traffic: Scenarios = Scenarios("traffic")


@dataclass(frozen=True, eq=False)
class StudiedScene:
    """A scene to study, with its traffic and the folders of the studies.

    Parameters
    ----------
    runs : list of Trajectories
        Runs of traffic next to the scene; may be empty.
    charts : path
        Folder of the charts.
    """

    survey: Survey
    runs: list[Trajectories]
    charts: Path
    scope: StabilityScope

    @property
    def name(self) -> str:
        """Name of the scene for titles."""
        return self.survey.site.name

    @property
    def sensor(self) -> str:
        """The middle one of the sensor types, which neither covers nearly everything nor nearly nothing."""
        sensors = list(self.survey.models)
        return sensors[len(sensors) // 2]

    @property
    def placed(self) -> str:
        """Name of the placement for titles."""
        return f"{DEFAULT_COUNT} × {self.sensor}"

    def problem(self, sensor: str) -> PlacementProblem:
        """Return the placement problem of `DEFAULT_COUNT` sensors of one type."""
        site = self.survey.site
        problem = placement_problem(site, self.survey.grid.visible, self.survey.models, Objective(count=DEFAULT_COUNT))
        return replace(problem, forbidden=problem.forbidden | (site.candidates.sensor != sensor))


Work = Callable[[StudiedScene], Generator[Progress, None, Chapter]]


def chapters(scene: StudiedScene) -> Iterator[tuple[str, Work]]:
    """Yield the chapters that are possible for a scene, with the names of their files."""
    yield "criterion", criterion
    yield "arithmetic", arithmetic
    yield "poses", poses
    yield "failures", failures
    if len(scene.runs) > 1:
        yield "traffic", traffic
    yield "weather", weather


def criterion(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Vary δ, grid spacings and beam azimuth."""
    survey = scene.survey
    delta = survey.settings.visibility.delta
    study = yield from criterion_study(survey.geometry, survey.settings, DEFAULT_COUNT, draws=scene.scope.grids)
    limits_charts.save_ring_border_chart(scene.charts / "ring_borders.png", study, delta, f"{scene.name}: rings and δ")
    limits_charts.save_border_check_chart(scene.charts / "beyond_border.png", study, f"{scene.name}: beyond the border")
    limits_charts.save_delta_chart(scene.charts / "delta.png", study, delta, f"{scene.name}: coverage against δ")
    limits_charts.save_convergence_chart(scene.charts / "convergence.png", study, f"{scene.name}: spacings")
    return Chapter(
        "The criterion of visibility",
        tuple(criterion_rows(study, delta)),
        (
            Chart("ring_borders.png", "Border: distance beyond which rings on a level road are more than 2δ apart"),
            Chart(
                "beyond_border.png",
                "Share of the targets in view that count as seen, by distance in multiples of the border",
            ),
            Chart(
                "delta.png", "Coverage of the best placement, and share of targets in view of its sensors, against δ"
            ),
            Chart("convergence.png", "Coverage of the best placement against the spacings of targets and posts"),
        ),
    )


def arithmetic(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Compare the ray casters with float64."""
    study = yield from arithmetic_study(scene.scope.rays)
    limits_charts.save_rounding_chart(scene.charts / "rounding.png", study, "Hits against float64")
    return Chapter(
        "Arithmetic",
        tuple(arithmetic_rows(study)),
        (
            Chart(
                "rounding.png", "Error of hits against the distance of the scene, or of a stray mesh, from the origin"
            ),
        ),
    )


def poses(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study a placement under pose errors."""
    survey, errors = scene.survey, scene.scope.robust.pose_errors
    study = yield from _robust(scene, TAIL_RISKS)
    deployment = survey.deploy(study[0].nominal.placement.chosen)
    under_errors = yield from pose_study(surroundings(survey), deployment, errors, 0, scene.scope.draws)
    robustness_charts.save_spread_chart(scene.charts / "spread.png", study, f"{scene.placed} under pose errors")
    robustness_charts.save_loss_chart(scene.charts / "blame.png", under_errors, f"{scene.placed}: what costs coverage")
    robustness_charts.save_frontier_chart(
        scene.charts / "frontier.png", study, f"{scene.placed}: what robustness costs and saves"
    )
    return Chapter(
        f"Pose errors: {scene.placed}",
        (*pose_rows(under_errors), *robust_rows(study)),
        (
            Chart("spread.png", "Distribution of coverage over unseen draws: nominal optimum and robust placements"),
            Chart("blame.png", "Mean loss with errors of only one sensor, and with only one kind of error"),
            Chart("frontier.png", "Cost of robustness in planned coverage, and gain in the 5 % quantile"),
        ),
    )


def failures(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study placements under sensor failures and multi-cover."""
    study = yield from _robust(scene, RISKS)
    robustness_charts.save_spread_chart(scene.charts / "failures.png", study, f"{scene.placed}: failures")
    caption = "Distribution of remaining coverage over unseen draws: placements for failures and the nominal optimum"
    return Chapter(f"Failures: {scene.placed}", robust_rows(study), (Chart("failures.png", caption),))


def _robust(scene: StudiedScene, risks: Sequence[Risk]) -> Generator[Progress, None, tuple[Comparison, ...]]:
    """Optimise for risk measures, and evaluate the placements on held-out scenarios."""
    problem = RobustProblem(surroundings(scene.survey), scene.problem(scene.sensor), scene.scope.robust)
    placements = yield from problem.placements(risks, scene.survey.settings.limits)
    return (yield from problem.compare(*placements))


def traffic(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study placements in traffic."""
    survey, scenarios = scene.survey, scene.scope.traffic
    problem = RobustProblem(surroundings(survey), scene.problem(scene.sensor), scenarios, split_runs(scene.runs))
    placements = yield from problem.placements([Risk()], survey.settings.limits)
    (study,) = yield from problem.compare(*placements)
    deployment = survey.deploy(study.robust.placement.chosen)
    title = f"{scene.placed} in traffic"
    robustness_charts.save_time_map(scene.charts / "time_seen.png", survey, deployment, study.robust, title)
    robustness_charts.save_traffic_chart(scene.charts / "promise.png", study, scene.placed, title)
    return Chapter(
        f"Occlusion by traffic: {scene.placed}",
        traffic_rows(study),
        (
            Chart(
                "time_seen.png", "Share of time for which each target, and the point above it, is visible in traffic"
            ),
            Chart("promise.png", "Coverage of placements on the empty road and, on average over time, in traffic"),
        ),
    )


def weather(scene: StudiedScene) -> Generator[Progress, None, Chapter]:
    """Study a fleet in rain and fog, and the effect of weather on the scene's own types."""
    survey = scene.survey
    study = yield from weather_study(survey.geometry, survey.settings)
    best = yield from solve(scene.problem(scene.sensor), survey.settings.limits)
    sensors = survey.deploy(best.chosen).sensors
    rows = weather_rows(study, untouched_types(survey, scene.placed, sensors))
    limits_charts.save_weather_chart(scene.charts / "weather.png", study, f"{scene.name} in rain and fog")
    caption = "Coverage by weather: placements for clear air and for the weather, and sensors with a longer range"
    return Chapter(f"Weather: {study.count} × {study.sensor}", rows, (Chart("weather.png", caption),))


def introduction(scene: StudiedScene) -> str:
    """Return the introduction of the page."""
    site = scene.survey.site
    return (
        "For each method: the point at which it begins to fail, how that was found, and what the program does about "
        f"it. Written by `seip study stability`: {site.name}, {len(site.targets):,} targets, "
        f"{len(site.candidates):,} poses. Brackets hold 95 % intervals. Warnings about a scene and a placement are "
        "shown in the panel and in the batch output, and stored in `placement.json`; the warning about occlusion by "
        "traffic needs an evaluation in traffic."
    )
