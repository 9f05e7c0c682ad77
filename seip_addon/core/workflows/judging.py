"""Request of a judgement of finalists, which a Python with PyTorch answers."""

from __future__ import annotations

import json
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..choosing.placement.judgement import Judgement
from ..errors import SeipError
from ..progress import Progress
from ..sensing.lidar.model import LidarModel
from ..sensing.scans.sensor import MountedSensor
from ..storage.files import save_json
from ..storage.json_dataclass import from_json
from .detection import DetectionJob, run_elsewhere
from .finalists import Finalist
from .survey import Survey

Content = TypeVar("Content")

JUDGED_CLASSES = ("vehicles", "two-wheelers", "pedestrians")
"""Classes of road users, in the order of the shares of an objective."""


@dataclass(frozen=True)
class JudgedSensor:
    """A sensor of a finalist.

    Parameters
    ----------
    sensor : str
        Its type's catalogue key.
    place : str
        Position and height, for people.
    xyz : tuple of float, metres
    orientation : tuple of float
        Rotation from its axes to the site's, row by row.
    """

    label: str
    sensor: str
    place: str
    xyz: tuple[float, ...]
    orientation: tuple[float, ...]


@dataclass(frozen=True)
class RequestedFinalist:
    """A finalist: its name, the rows of its poses, and its sensors."""

    name: str
    poses: tuple[int, ...]
    sensors: tuple[JudgedSensor, ...]

    @property
    def places(self) -> tuple[str, ...]:
        """Positions and heights of its sensors."""
        return tuple(sensor.place for sensor in self.sensors)

    def mounted(self, models: Mapping[str, LidarModel]) -> tuple[MountedSensor, ...]:
        """Return its sensors as scans have them, with the models of their types."""
        return tuple(
            MountedSensor(one.label, models[one.sensor], np.array(one.xyz), np.reshape(one.orientation, (3, 3)))
            for one in self.sensors
        )


@dataclass(frozen=True)
class JudgementRequest:
    """Finalists, the best by the criterion first, and the weight of each class of road users."""

    finalists: tuple[RequestedFinalist, ...]
    weights: Mapping[str, float]

    def save(self, path: Path) -> None:
        """Write it to a file."""
        save_json(path, asdict(self))


def judgement_request(survey: Survey, shares: Sequence[float], finalists: Sequence[Finalist]) -> JudgementRequest:
    """Return the request of a judgement.

    Parameters
    ----------
    shares : (3,) float
        Importance of cars, cyclists and pedestrians.
    """
    each = []
    for one in finalists:
        sensors = survey.deploy(one.chosen).sensors
        judged = tuple(
            JudgedSensor(
                sensor.label,
                sensor.model.key,
                f"{sensor.position_name} at {sensor.height:g} m",
                tuple(sensor.xyz.tolist()),
                tuple(sensor.orientation.ravel().tolist()),
            )
            for sensor in sensors
        )
        each.append(RequestedFinalist(one.name, tuple(one.chosen.tolist()), judged))
    return JudgementRequest(tuple(each), dict(zip(JUDGED_CLASSES, shares, strict=True)))


def read_request(path: Path) -> JudgementRequest:
    """Read what `JudgementRequest.save` wrote."""
    return _read(JudgementRequest, path)


def judge_elsewhere(
    job: DetectionJob, request: JudgementRequest, scene: Path, folder: Path
) -> Generator[Progress, None, Judgement]:
    """Judge finalists in another Python, which has PyTorch.

    Parameters
    ----------
    scene : path
        A .blend in a folder for temporary files.
    folder : path
        What was detected is kept in it.

    Raises
    ------
    SeipError
        The command fails.
    """
    asked, answered = scene.parent / "finalists.json", scene.parent / "judgement.json"
    request.save(asked)
    command = [job.python.program, "-m", "headless.judge", scene, asked, answered, "-o", folder, *job.options()]
    yield from run_elsewhere(job.python, command, scene.parent / "log")
    return _read(Judgement, answered)


def _read(kind: type[Content], path: Path) -> Content:
    try:
        return from_json(kind, json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise SeipError(f"{path} is damaged or missing ({error}): judge again") from error
