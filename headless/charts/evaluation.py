"""Charts of a placement that was optimised over scenarios."""

from __future__ import annotations

from pathlib import Path

from headless.charts.pose_errors import save_frontier_chart, save_loss_chart, save_spread_chart
from headless.charts.traffic import save_time_map, save_traffic_chart

from seip_addon.core.choosing.placement.objective import Solution
from seip_addon.core.choosing.robustness.pose_error_evaluation import PoseErrorEvaluation
from seip_addon.core.choosing.robustness.traffic_study import TrafficStudy
from seip_addon.core.counts import counted
from seip_addon.core.output.results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURES
from seip_addon.core.workflows.survey import Survey


def save_evaluation_charts(folder: Path, survey: Survey, solution: Solution) -> None:
    """Draw the evaluation of a solution in a folder, as PNG, and remove the charts of an earlier result there."""
    evaluation, name = solution.evaluation, survey.site.name
    for picture in (*POSE_ERROR_PICTURES, *TRAFFIC_PICTURES):
        (folder / picture).unlink(missing_ok=True)
    if isinstance(evaluation, PoseErrorEvaluation) and evaluation.pose_study is not None:
        spread, losses, frontier = (folder / picture for picture in POSE_ERROR_PICTURES)
        save_spread_chart(spread, evaluation.study, f"{name}: coverage under pose errors")
        save_loss_chart(losses, evaluation.pose_study, f"{name}: what costs coverage")
        save_frontier_chart(frontier, evaluation.study, f"{name}: what robustness costs and saves")
    if isinstance(evaluation, TrafficStudy):
        time_seen, traffic = (folder / picture for picture in TRAFFIC_PICTURES)
        title = f"{name}: share of time seen, {evaluation.road_users:.0f} road users at a time"
        save_time_map(time_seen, survey.geometry, survey.site, solution.deployment, evaluation.traffic, title)
        sensors = counted(len(solution.deployment.sensors), "sensor")
        save_traffic_chart(traffic, evaluation, sensors, f"{name}: empty road and traffic")
