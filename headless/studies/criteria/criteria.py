"""Criteria by which placements could be chosen: coverage, and what stands beside it."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from headless.detection.recordings import Simulator
from headless.studies.detection.case_study import Traffic
from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.choosing.placement.deployment import weighted_share
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.returns.expected_returns import expected_returns
from seip_addon.core.sensing.returns.road_users import BODIES, RoadUsers
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.workflows.survey import Survey

from .occupancy import vehicle_occupancy
from .pose_criteria import PoseCriterion, entropy
from .precision import ENOUGH_RETURNS, Precisions


@dataclass(frozen=True, eq=False)
class Criterion:
    """A figure of each placement, the more the better.

    Parameters
    ----------
    key : str
        In tables.
    name : str
        In charts and sentences.
    values : (n,) float64
        Figure of each placement.
    beforehand : bool
        Whether it can be had without the traffic that the detector is tested on.
    """

    key: str
    name: str
    values: Float
    beforehand: bool = True


WEIGHTED = {
    "coverage weighted by regions": "weighted_coverage",
    "coverage weighted by traffic": "traffic_coverage",
    "occupancy entropy seen (S-MIG)": "occupancy_entropy",
}
"""Keys of criteria that are coverage with other weights of targets, by name."""


def weights_of_targets(survey: Survey, traffic: Traffic) -> dict[str, Float]:
    """Return the weights of targets (t,) of the criteria that are weighted coverage, by name; see `criteria_of`."""
    targets = survey.site.targets
    often = vehicle_occupancy(targets, traffic.training)
    weights = dict(zip(WEIGHTED, (targets.weight, often, entropy(often)), strict=True))
    return {name: weight for name, weight in weights.items() if weight is not targets.weight or targets.central.any()}


def criteria_of(
    survey: Survey,
    simulator: Simulator,
    placements: Sequence[SensorConfiguration],
    traffic: Traffic,
    precise: Precisions,
    others: Sequence[PoseCriterion] = (),
) -> Generator[Progress, None, tuple[Criterion, ...]]:
    """Return coverage, and what could be optimised in its place; traffic is that of the runs to learn from alone.

    `weighted`: the scene's own weights of targets (a central area). `traffic`: targets weighted by how often a vehicle
    stands there. `occupancy entropy`: weighted by the entropy of whether one stands there, as S-MIG weights voxels (Hu
    et al. 2022). `returns`: share of targets where a car would have `ENOUGH_RETURNS` or more. `log returns`: the mean
    logarithm of a car's returns, as perception entropy takes it (Ma et al. 2021).

    Parameters
    ----------
    others : sequence of PoseCriterion
        More criteria of the survey's candidate poses.
    """
    targets = survey.site.targets
    seen = [one.deployment.seen_by > 0 for one in placements]
    returns = yield from _returns(simulator, placements, cars_at(targets.xyz))
    return (
        Criterion("coverage", "coverage", np.array([one.deployment.coverage for one in placements])),
        *(
            Criterion(WEIGHTED[name], name, np.array([weighted_share(one, weight) for one in seen]))
            for name, weight in weights_of_targets(survey, traffic).items()
        ),
        Criterion(
            "targets_with_returns",
            f"targets with {ENOUGH_RETURNS} returns of a car",
            (returns >= ENOUGH_RETURNS).mean(axis=1),
        ),
        Criterion("log_returns", "mean log of a car's returns", np.log1p(returns).mean(axis=1)),
        *(
            Criterion(
                one.key,
                one.name,
                np.array([one.value(np.array([s.pose for s in placed.deployment.sensors])) for placed in placements]),
            )
            for one in others
        ),
        Criterion(
            "test_vehicles_with_returns",
            f"test vehicles with {ENOUGH_RETURNS} returns (not beforehand)",
            precise.share_with_returns,
            beforehand=False,
        ),
    )


def _returns(
    simulator: Simulator, placements: Sequence[SensorConfiguration], cars: RoadUsers
) -> Generator[Progress, None, Float]:
    """Return how many returns a car at each target would have of each placement's sensors, (n, t)."""
    caster = make_ray_caster(simulator.static.triangles, simulator.settings.engine)
    known: dict[tuple[float | str, ...], Float] = {}
    rows = []
    for done, placement in enumerate(placements):
        yield Progress(done, len(placements), "count a car's returns")
        row = np.zeros(len(cars))
        for sensor in placement.sensors:
            key = (sensor.model.key, *sensor.xyz.tolist(), *sensor.orientation.ravel().tolist())
            if key not in known:
                known[key], _ = expected_returns(caster, sensor.xyz, sensor.orientation, sensor.model, cars)
            row += known[key]
        rows.append(row)
    return np.array(rows)


def cars_at(points: Float) -> RoadUsers:
    """Return a car at each of some points (m, 3), metres."""
    count = len(points)
    body, none = np.full(count, BODIES.index("car")), np.full(count, -1)
    return RoadUsers(points, body, np.ones(count), np.zeros(count, dtype=bool), none, ())
