"""Python interface: from a scene to a placement and to scans, in arrays.

    import seip_addon.api as seip

Needs Blender's module ``bpy``, or Blender itself. The steps are those of the
panel and of the commands, without files and without Blender's window.

Examples
--------
>>> import seip_addon.api as seip
>>> geometry = seip.read_scene("scenes/junction.blend")
>>> candidates = seip.CandidateSettings(sensors=("type3",), heights=(8.0,), spacing=15.0)
>>> layout = seip.lay_out(geometry, seip.SurveySettings(candidates, grid_spacing=4.0))
>>> len(layout.site.targets), len(layout.site.candidates)
(306, 36)
>>> survey = seip.compute_visibility(layout)
>>> survey.grid.visible.shape
(36, 306)
>>> solution = seip.place(survey, seip.Objective(count=2))
>>> solution.placement.status, round(solution.deployment.coverage, 4)
('optimal', 0.8922)
>>> errors = seip.Scenarios("pose-errors", count=4, held_out=40)
>>> robust = seip.place(survey, seip.Objective(count=2, scenarios=errors, risk="worst-quarter"))
>>> print(robust.evaluation.summary()[0])
planned coverage 89.22%, the nominal optimum's 89.22%
>>> traffic = seip.load_traffic("scenes/junction_traffic/run-1.npz", geometry)
>>> frame = seip.scan(geometry, solution, traffic, time=30.0)
>>> frame.points.dtype, frame.points.shape[1], len(frame.labels.category)
(dtype('float32'), 3, 54)
"""

import os
from collections.abc import Sequence
from pathlib import Path

from .core.base.progress import finish
from .core.choosing.placement.objective import Objective, Solution
from .core.choosing.placement.scenarios import Scenarios
from .core.sensing.scans.frame import Frame
from .core.sensing.scans.simulation import ScanSettings
from .core.sensing.scenarios.pose_errors import PoseErrors
from .core.sensing.traffic.source import TrafficFiles
from .core.sensing.traffic.source import load_traffic as _load_traffic
from .core.sensing.traffic.trajectories import Trajectories
from .core.sensing.visibility.grid import compute_visibility as _compute
from .core.sensing.visibility.settings import VisibilitySettings
from .core.site.candidates import CandidateSettings
from .core.site.scene_geometry import SceneGeometry
from .core.workflows.placing import place as _place
from .core.workflows.recording import RecordingSettings, frame_number, make_run, simulation_of
from .core.workflows.survey import Layout, Survey, lay_out, with_grid
from .core.workflows.survey_settings import SurveySettings
from .core.workflows.traffic_runs import independent_runs

__all__ = [
    "CandidateSettings", "Objective", "PoseErrors", "ScanSettings", "Scenarios", "SurveySettings", "VisibilitySettings",
    "compute_visibility", "lay_out", "load_traffic", "place", "read_scene", "scan",
]  # fmt: skip


def read_scene(path: str | os.PathLike[str] | None = None) -> SceneGeometry:
    """Read the scene of a .blend, or the scene that is open.

    Parameters
    ----------
    path : path, optional
        Opened in place of the open file.

    Raises
    ------
    SeipError
        The file cannot be opened, or the scene lacks the region or the road.
    """
    import bpy  # noqa: PLC0415  # the rest of this module needs no Blender

    from .scene.blend_file import open_blend  # noqa: PLC0415  # as above
    from .scene.read import read_scene as read  # noqa: PLC0415  # as above

    if path is not None:
        open_blend(Path(path))
    return read(bpy.context.scene).geometry


def compute_visibility(layout: Layout, threads: int | None = None) -> Survey:
    """Compute which candidate sees which target.

    Parameters
    ----------
    threads : int, optional
        Maximum number of threads; by default the number that saves time.

    Returns
    -------
    Survey
        The layout with its ``grid``, whose ``visible`` is a (candidates, targets) bool array.
    """
    settings = layout.settings
    steps = _compute(layout.site, layout.models, settings.visibility, settings.engine, threads=threads)
    return with_grid(layout, finish(steps))


def place(survey: Survey, objective: Objective, runs: Sequence[Trajectories] = ()) -> Solution:
    """Solve the placement problem: a criterion over scenarios with a risk measure, under constraints.

    Parameters
    ----------
    runs : sequence of Trajectories
        Two or more where the scenarios are traffic: the last third evaluates what is optimised on the others.

    Returns
    -------
    Solution
        Its ``placement`` holds the chosen candidates with objective, bound and gap, its ``deployment`` the sensors with
        coverage and price, its ``evaluation`` the comparison with the nominal optimum on held-out scenarios.

    Raises
    ------
    SeipError
        The objective contradicts itself or the site.
    """
    named = {f"run {number}": run for number, run in enumerate(runs, start=1)}
    return finish(_place(survey, objective, independent_runs(named, survey.site) if named else None))


def load_traffic(path: str | os.PathLike[str], geometry: SceneGeometry) -> Trajectories:
    """Read trajectories (.npz) or floating car data of SUMO, in the axes of a scene."""
    return finish(_load_traffic(TrafficFiles(Path(path)), geometry)).trajectories


def scan(
    geometry: SceneGeometry,
    solution: Solution,
    traffic: Trajectories,
    time: float,
    settings: ScanSettings | None = None,
) -> Frame:
    """Scan traffic at a time in seconds with the sensors of a placement.

    Returns
    -------
    Frame
        Merged point cloud with the boxes of all road users.
    """
    run = make_run(geometry, solution.deployment.sensors, traffic, RecordingSettings(settings or ScanSettings()), {})
    return finish(simulation_of(run)).frame(*frame_number(run, time))
