"""Sensor configuration of a study: a placement with the type and number that charts and tables group it under."""

from __future__ import annotations

from dataclasses import dataclass, field

from headless.detection.recordings import MountedSensors
from headless.studies.coverage.cells import Case

from seip_addon.core.choosing.placement.deployment import Deployment
from seip_addon.core.sensing.scans.sensor import MountedSensor


@dataclass(frozen=True, eq=False)
class SensorConfiguration(MountedSensors):
    """Sensors of a placement, however it came about.

    Parameters
    ----------
    sensors : tuple of MountedSensor
        Those of the deployment.
    sensor : str
        What charts and tables group it under: the type, or the name of a placement that was read.
    count : int
        N, the number of sensors asked for.
    status : str
        As in `Placement`.
    gap : float
        Infinite where nothing bounds it.
    read : bool
        Whether it was read from a folder; it is no number of sensors of a type then.
    """

    sensors: tuple[MountedSensor, ...] = field(init=False)
    deployment: Deployment
    sensor: str
    count: int
    status: str
    gap: float
    read: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", self.deployment.mounted)

    @classmethod
    def of_case(cls, case: Case) -> SensorConfiguration:
        """Return a number of sensors of one type, placed where they cover most."""
        name = f"{case.count} × {case.sensor}"
        return cls(name, case.deployment, case.sensor, case.count, case.placement.status, case.placement.gap)
