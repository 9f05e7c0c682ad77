"""Session: all that the add-on keeps in memory of the open file, in one object.

None of it is needed to go on: the file keeps what was asked and found, and the cache keeps visibility. Scenes are named
by their session number, as undo and redo put another Python object in place of each.

`tests/addon/test_staleness.py` shows its use.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Generator, Mapping
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.base.acceptance import Acceptance
from ..core.base.arrays import Boolean
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, finish
from ..core.choosing.placement.objective import Solution
from ..core.choosing.placement.returns_summary import ReturnsSummary
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.scans.frame import Frame
from ..core.sensing.scans.run_folder import Run
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.scans.simulation import Simulation
from ..core.sensing.visibility.visibility_model import VisibilityModel
from ..core.site.check import SiteCheck
from ..core.workflows.returns import SensorReturns
from ..core.workflows.site_places import SitePlaces
from ..core.workflows.survey import Layout, Survey
from ..core.workflows.survey_settings import SurveySettings
from ..scene.changes import Watch

Result = TypeVar("Result")


class RunningWork(Generic[Result]):
    """Work of an operator, which runs in a thread of its own from now on.

    Parameters
    ----------
    operator : str
        Its ``bl_idname``.
    steps : generator of Progress
        Stopped at its next report, and closed, once somebody asks for that.
    acceptance : Acceptance, optional
        Ends a search with the best placement found so far.

    Attributes
    ----------
    progress : Progress
        The last report.
    shown : (Progress, str)
        Progress and time that are shown; see `progress_line`.
    timer : bpy.types.Timer or None
        Has somebody look at it from time to time.
    """

    def __init__(
        self, operator: str, steps: Generator[Progress, None, Result], acceptance: Acceptance | None = None
    ) -> None:
        self.operator, self.acceptance = operator, acceptance
        self.progress = Progress(0, 0, "starting")
        self.shown, self.timer = (self.progress, ""), None
        self._stop = threading.Event()
        self._end: Future[Result] = Future()
        self._thread = threading.Thread(target=self._run, args=(steps,), daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether there is a result, or an error in its place."""
        return self._end.done()

    def result(self) -> Result:
        """Return the result, or raise what went wrong; waits for the end."""
        return self._end.result()

    @property
    def stopped(self) -> bool:
        """Whether somebody has asked the work to end."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask the work to end at its next report, and return at once."""
        self._stop.set()

    def join(self, seconds: float) -> bool:
        """Wait for the thread to end, no longer than some seconds; return whether it did."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self, steps: Generator[Progress, None, Result]) -> None:
        def report(progress: Progress) -> None:
            self.progress = progress
            if self.stopped:
                raise CancelledError

        try:
            result = finish(steps, report)
        except BaseException as error:  # noqa: BLE001  # raised again when the result is read
            self._end.set_exception(error)
        else:
            self._end.set_result(result)


@dataclass(frozen=True)
class SceneState:
    """State of a scene: its layout or survey, its placement, and their inputs.

    Parameters
    ----------
    layout : Layout or Survey
        As the scene was when it was last read; a survey as soon as its visibility grid was computed.
    inputs : mapping of str to str
        Digests of what a placement on that layout follows from; see `inputs_of`.
    watch : Watch
        Whether the scene has changed since.
    grid_file : Path
        Where the cache keeps the visibility grid, by the preferences at the last request.
    catalogues : tuple
        The user's catalogue files and when each was last written.
    solution : Solution or None
        The one that the scene's result tells of.
    record : str
        The result that the solution was taken from.
    durations : mapping of str to float, seconds
    """

    layout: Layout
    inputs: Mapping[str, str]
    watch: Watch
    grid_file: Path
    catalogues: tuple[tuple[Path, int], ...]
    warnings: tuple[str, ...] = ()
    solution: Solution | None = None
    record: str = ""
    durations: Mapping[str, float] = field(default_factory=dict)

    @property
    def survey(self) -> Survey | None:
        """The survey, or None where the visibility grid was not computed."""
        return self.layout if isinstance(self.layout, Survey) else None

    def placed(self) -> tuple[Survey, Solution]:
        """Return the survey and the placement on it, for work that has made sure of them."""
        if self.survey is None or self.solution is None:
            raise RuntimeError("the work ended without a placement")
        return self.survey, self.solution

    def timed(self, step: str, began: float) -> dict[str, float]:
        """Return the durations with that of a step that began at a reading of `time.perf_counter`."""
        return {**self.durations, step: time.perf_counter() - began}


@dataclass(frozen=True)
class CheckedScene:
    """A check of a site, and its inputs.

    Parameters
    ----------
    watch : Watch
        Whether the scene has changed since.
    settings : SurveySettings or str
        See `scene_status.survey_settings`.
    """

    found: SiteCheck
    watch: Watch
    settings: SurveySettings | str


Followed = tuple[MountedSensor, Boolean, NDArray[np.float32] | None]
"""Last pose of a sensor, the targets seen (t,), and the returns from road users (m,) if these are wanted."""


@dataclass
class FollowedSensors:
    """Sensors whose coverage is computed again whenever they are moved.

    Parameters
    ----------
    scene : int
        The scene's session number.
    visibility : VisibilityModel
        Visibility of the site.
    returns : SensorReturns or None
        Returns from road users, for a placement that was chosen for them.
    sensors : dict of str to Followed
    coverage : float
        Share of the targets that some sensor sees.
    summary : ReturnsSummary or None
        Returns of all sensors together.
    problem : str
        Why nothing is followed at the moment.
    """

    scene: int
    state: SceneState
    visibility: VisibilityModel
    returns: SensorReturns | None
    sensors: dict[str, Followed] = field(default_factory=dict)
    coverage: float = 0.0
    summary: ReturnsSummary | None = None
    problem: str = ""


@dataclass
class LastScan:
    """Sensors that are ready to scan, and what they measured last.

    Parameters
    ----------
    run : Run
        What the scans follow from.
    seconds : float
    facts : tuple of str
        What came of it, one sentence each.
    """

    run: Run
    simulation: Simulation
    frame: Frame
    seconds: float
    facts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        counts = np.bincount(self.frame.sensor, minlength=len(self.run.sensors)).tolist()
        users = self.frame.labels.points.sum(axis=1)
        lines = [f"{sensor.label}: {count:,} points" for sensor, count in zip(self.run.sensors, counts, strict=True)]
        lines.append(f"{np.count_nonzero(users)} of {len(users)} road users seen")
        lines.append(f"{self.frame.time:.2f} s, scanned in {1e3 * self.seconds:.0f} ms")
        self.facts = tuple(lines)


@dataclass
class SceneMemory:
    """Memory of a scene: its state, check and last scan."""

    state: SceneState | None = None
    check: CheckedScene | None = None
    scan: LastScan | None = None


@dataclass
class Session:
    """All that the add-on keeps in memory.

    Parameters
    ----------
    scenes : dict of int to SceneMemory
        By the scene's session number.
    sensor_types : dict of str to LidarModel
        By catalogue key: the shipped types and those of the user's own files.
    catalogue_error : str
        What is wrong with one of the user's catalogues; empty where nothing is.
    running : RunningWork or None
        There is one piece of work at a time.
    following : FollowedSensors or None
        One scene is followed at a time.
    places : SitePlaces or None
        Junctions of the file that was read last, to choose from.
    """

    scenes: dict[int, SceneMemory] = field(default_factory=dict)
    sensor_types: dict[str, LidarModel] = field(default_factory=dict)
    catalogue_error: str = ""
    running: RunningWork[Any] | None = None
    following: FollowedSensors | None = None
    places: SitePlaces | None = None

    def of(self, scene: bpy.types.Scene) -> SceneMemory:
        """Return what is known of a scene; work that has ended stores there what it has found, on the main thread."""
        return self.scenes.setdefault(scene.session_uid, SceneMemory())


session = Session()  # there is one Blender, and one file open in it


def scene_of(number: int) -> bpy.types.Scene:
    """Return the scene with a session number.

    Raises
    ------
    SeipError
        It was deleted.
    """
    for scene in bpy.data.scenes:
        if scene.session_uid == number:
            return scene
    raise SeipError("the scene that this was computed for is gone: nothing was written")


def forget() -> None:
    """Let go of what is known of the open file."""
    session.scenes.clear()
    session.places = None
