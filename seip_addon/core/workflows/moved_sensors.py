"""Evaluation of deployments whose sensors were moved by hand."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.arrays import Boolean, Float
from ..base.errors import SeipError
from ..base.progress import Progress
from ..choosing.placement.deployment import Sensor, deployment_of, sensor_at
from ..choosing.placement.objective import MOVED, Objective, Solution, criterion_of, target_weights
from ..choosing.placement.problem import Placement
from ..choosing.robustness.gain_band import with_gain_band
from ..geometry.orientation import angles_of, degrees, tilt_degrees
from ..geometry.plan import surface_height
from ..sensing.scans.sensor import MountedSensor
from ..sensing.visibility.sight_lines import pose_at
from ..sensing.visibility.visibility_model import VisibilityModel, visibility_model
from ..site.scene_geometry import joined
from .returns import SensorReturns
from .survey import Layout, Survey, surroundings

BY_HAND = "by hand"
"""Name of a position that is not one of the site's."""


def evaluate_moved_sensors(
    survey: Survey,
    objective: Objective,
    mounted: Sequence[MountedSensor],
    places: Mapping[str, str],
) -> Generator[Progress, None, Solution]:
    """Evaluate sensors at their current poses; for candidate poses, visibility comes from the grid.

    Parameters
    ----------
    objective : Objective
        Objective of the original placement, for its weights and for whether it asked for the least price.
    mounted : sequence of MountedSensor
        Sensors in the order of their labels.
    places : mapping of str to str
        Names of positions by label, for sensors that are not at a candidate pose.

    Yields
    ------
    Progress
        Number of sensors done.

    Returns
    -------
    Solution
        Solution without bound, gap and greedy placement.

    Raises
    ------
    SeipError
        A sensor is below the ground.
    """
    site, models = survey.site, survey.models
    visibility: VisibilityModel | None = None
    sensors: list[Sensor] = []
    rows: list[Boolean] = []
    for done, one in enumerate(mounted):
        yield Progress(done, len(mounted), "evaluating the sensors' poses")
        pose = pose_at(site.candidates, one.model.key, one.xyz, one.orientation)
        if pose is not None:
            sensors.append(sensor_at(site, models, one.label, pose))
            rows.append(survey.grid.sees(pose))
            continue
        if visibility is None:
            visibility = visibility_model(site, survey.settings.visibility, survey.settings.engine)
        sensor = _off_candidates(survey, one, places.get(one.label, BY_HAND))
        sensors.append(sensor)
        rows.append(visibility.see(sensor.model, sensor.xyz, sensor.orientation))
    seen = np.array(rows, dtype=bool).reshape(len(rows), len(site.targets))
    deployment = yield from with_gain_band(surroundings(survey), deployment_of(site, sensors, seen))
    value = float(target_weights(site, objective)[deployment.seen_by > 0].sum())
    notes: tuple[str, ...] = ()
    if objective.cheapest:
        value = deployment.price
    elif criterion_of(objective, models) == "returns":
        yield Progress(len(mounted), len(mounted), "returns from road users")
        returns = SensorReturns(survey, objective)
        each = [returns.of(one) for one in sensors]
        summary, pedestrians = returns.summary(sensors, each), returns.near_targets(each)
        deployment = replace(deployment, returns=summary, pedestrian_returns=pedestrians)
        value, notes = math.log1p(summary.typical), summary.warnings()
    placement = Placement(
        chosen=np.array([sensor.pose for sensor in sensors if sensor.pose is not None], dtype=np.int64),
        objective=value,
        bound=math.nan,
        gap=math.inf,
        status=MOVED,
        solver="none",
        price=deployment.price,
        notes=notes,
    )
    return Solution(objective, placement, None, deployment)


def _off_candidates(layout: Layout, one: MountedSensor, place: str) -> Sensor:
    """Return a sensor that is not at a candidate pose, rounded as in records."""
    xyz = np.round(one.xyz, 6)
    foot = np.append(xyz[:2], _ground(layout, xyz))
    if xyz[2] < foot[2]:
        raise SeipError(f"sensor {one.label} is {foot[2] - xyz[2]:.2f} m below the ground: raise it")
    yaw, tilt, roll = angles_of(one.orientation)
    return Sensor(
        label=one.label,
        pose=None,
        model=one.model,
        position_name=place,
        on_pole=False,
        foot=foot,
        xyz=xyz,
        height=float(xyz[2] - foot[2]),
        yaw=math.radians(degrees(yaw)),
        tilt=math.radians(tilt_degrees(tilt)),
        roll=math.radians(tilt_degrees(roll)),
    )


def _ground(layout: Layout, xyz: Float) -> float:
    """Return the height of the ground under a point, or of the nearest target if there is no ground."""
    geometry, targets = layout.geometry, layout.site.targets.xyz
    under = float(surface_height(xyz[None, :2], joined((*geometry.roads, *geometry.ground)))[0])
    if math.isfinite(under):
        return under
    return float(targets[np.argmin(np.hypot(*(targets - xyz)[:, :2].T)), 2])
