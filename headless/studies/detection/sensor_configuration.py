"""Sensor configuration of a study: a placement with the type and number by which charts and tables group it."""

from __future__ import annotations

from dataclasses import dataclass, field

from headless.detection.recordings import MountedSensors
from headless.studies.coverage.cells import Case

from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.sensing.scans.sensor import MountedSensor


@dataclass(frozen=True, eq=False)
class SensorConfiguration(MountedSensors):
    """Sensors of a placement that a study optimised.

    Parameters
    ----------
    sensors : tuple of MountedSensor
        Sensors of the deployment.
    sensor : str
        Type, by which charts and tables group it.
    count : int
        N, the requested number of sensors.
    status : str
        Status as in `Placement`.
    gap : float
        Optimality gap; infinite without a bound.
    """

    sensors: tuple[MountedSensor, ...] = field(init=False)
    deployment: Deployment
    sensor: str
    count: int
    status: str
    gap: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", self.deployment.sensors)

    @classmethod
    def of_case(cls, case: Case) -> SensorConfiguration:
        """Return the configuration of a solved cell: sensors of one type with the largest coverage."""
        name = f"{case.count} × {case.sensor}"
        return cls(name, case.deployment, case.sensor, case.count, case.placement.status, case.placement.gap)
