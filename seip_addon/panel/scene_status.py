"""Status of a scene: what keeps it from being surveyed, whether what is known of it is stale, and edits by hand.

`tests/addon/test_staleness.py` shows its use.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.output.results.answer import sentence
from ..core.output.results.placement_record import RecordedSensor, parsed_record
from ..core.workflows.survey_settings import SurveySettings
from ..scene import contract
from ..scene.sensors import labelled_sensors, placed_sensors, pose_of
from .properties import complaint, saved_path
from .session import session

FILE_VERSION = 1
"""Version of what the add-on keeps with a scene: a file with a higher one was saved by a newer add-on."""
NEWER = "This file was saved by a newer version of SEIP: install that version to go on."
LINKED = "This scene is linked from another file: open that file to work on it."
NOT_COMPARED = "Not compared with the scene since the file was opened."
ANOTHER_SITE = "The scene or its settings have changed since this placement: place again."
NO_SITE = "There is no site yet."
UNEVALUATED = "There are sensors without figures in the scene: evaluate them."
OTHER_SENSORS = "The sensors or their heights have changed since: check again to count their poses."
NO_SENSORS = "There is no sensor in the scene: place sensors first."
POSE_TOLERANCE = 1e-5  # of single precision: of rotations absolute, of positions relative beyond a metre


def not_own(scene: bpy.types.Scene) -> str:
    """Return a reason if a scene belongs to another file and cannot be changed; otherwise an empty text."""
    return LINKED if scene.library is not None else ""


def is_newer(scene: bpy.types.Scene) -> bool:
    """Return whether a newer add-on saved the scene: nobody here knows what its record looks like."""
    return bool(scene.seip.version > FILE_VERSION)


def obstacle(scene: bpy.types.Scene) -> str:
    """Return the reason why nothing can be computed for a scene, as a sentence for panels and buttons, or ""."""
    if not_own(scene):
        return not_own(scene)
    if is_newer(scene):
        return NEWER
    for name, what in ((contract.REGION, "region"), (contract.ROADS, "road")):
        if not contract.has_members(scene, name):
            return f"There is no {what}: put a mesh into the collection {name!r}."
    return ""


def has_nothing(scene: bpy.types.Scene) -> bool:
    """Return whether there is neither a region nor a road: nobody has begun with a site."""
    return not any(contract.has_members(scene, name) for name in (contract.REGION, contract.ROADS))


def has_unevaluated(scene: bpy.types.Scene) -> bool:
    """Return whether there are sensors without a placement, as in a file that a command wrote."""
    return not scene.seip.result.record and bool(labelled_sensors(scene, hidden=True))


def next_step(scene: bpy.types.Scene) -> str:
    """Return the operator, by its ``bl_idname``, that comes next on the way to placed sensors; empty at its end."""
    if not_own(scene) or is_newer(scene):
        return ""
    if scene.seip.result.record:
        return "seip.solve_placement" if other_goal(scene) else ""
    if obstacle(scene):
        return _next_for_site(scene.seip.site)
    if has_unevaluated(scene):
        return "seip.evaluate_sensors"
    if session.of(scene).check is None:
        return "seip.check_site"
    return "seip.solve_placement" if scene.seip.survey.used_types() else "seip.choose_sensors"


def _next_for_site(site: bpy.types.PropertyGroup) -> str:
    if site.has_place():
        return "seip.build_site"
    return "seip.download_map" if site.new_site and not site.source else "seip.choose_map"


def current_step(scene: bpy.types.Scene) -> str:
    """Return the step of the sidebar in which the next operator is, or the answer: site, sensors or placement."""
    operator = next_step(scene)
    if operator == "seip.choose_sensors":
        return "sensors"
    is_last = operator in {"", "seip.solve_placement", "seip.evaluate_sensors"}
    return "placement" if is_last and not has_nothing(scene) else "site"


def search_seconds(scene: bpy.types.Scene) -> float | None:
    """Return an approximate upper limit of the time of a search in seconds; None if visibility is not computed yet."""
    state = session.of(scene).state
    if state is None or state.survey is None or stale_survey(scene):
        return None
    return float(scene.seip.survey.effort)


def stale_survey(scene: bpy.types.Scene) -> str:
    """Return why the survey of a scene is not of the scene as it is, in a sentence; empty if it is."""
    state = session.of(scene).state
    if state is None:
        return ""
    if state.watch.changed:
        return "The scene has changed since it was computed."
    settings = survey_settings(scene)
    if isinstance(settings, str):
        return settings
    return "" if same_grid(settings, state.layout.settings) else "The settings have changed since it was computed."


def stale_placement(scene: bpy.types.Scene) -> str:
    """Return why the scene's placement is not of the scene as it is, in a sentence; empty if it is."""
    state = session.of(scene).state
    if state is None:
        return NOT_COMPARED
    record = parsed_record(scene.seip.result.record)
    return stale_survey(scene) or ("" if record.is_of(state.inputs) else ANOTHER_SITE)


def other_goal(scene: bpy.types.Scene) -> str:
    """Return whether the goal is another than that of the scene's placement, in a sentence; empty if it is the same."""
    try:
        same = scene.seip.goal.objective() == parsed_record(scene.seip.result.record).request.goal
    except SeipError as error:
        return str(error)
    return "" if same else "The goal has changed: place again for it."


def stale_check(scene: bpy.types.Scene) -> str:
    """Return why the scene's check is not of the scene as it is, in a sentence; empty if it is, or without a check."""
    check = session.of(scene).check
    if check is None:
        return ""
    if check.watch.changed:
        return "The scene has changed since the check."
    settings = survey_settings(scene)
    if same_grid(check.settings, settings):
        return ""
    is_same_site = same_grid(check.settings, settings, sensors=False)
    return OTHER_SENSORS if is_same_site else "The settings have changed since the check."


def survey_settings(scene: bpy.types.Scene) -> SurveySettings | str:
    """Return the settings of a scene's survey, or what is wrong with them."""
    try:
        settings: SurveySettings = scene.seip.survey.settings()
    except SeipError as error:
        return str(error)
    return settings


def same_grid(one: SurveySettings | str, other: SurveySettings | str, *, sensors: bool = True) -> bool:
    """Return whether settings differ at most in how a placement is searched, and in sensors, heights and tilts."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    as_other = replace(one, solver=other.solver, effort=other.effort)
    if not sensors:
        own, theirs = one.candidates, other.candidates
        mounts = replace(own, sensors=theirs.sensors, heights=theirs.heights, tilts=theirs.tilts)
        as_other = replace(as_other, candidates=mounts)
    return as_other == other


def no_placement(scene: bpy.types.Scene) -> str:
    """Say that there is no placement that can be shown; empty if there is one."""
    if is_newer(scene):
        return NEWER
    if not scene.seip.result.record:
        missing = "There is no placement yet: place sensors first."
        return UNEVALUATED if has_unevaluated(scene) else missing
    return complaint(lambda: parsed_record(scene.seip.result.record))


def no_folder(scene: bpy.types.Scene) -> str:
    """Say why there is no folder yet to write the result to, and the cure; empty if there is one."""
    problem = complaint(lambda: saved_path(scene.seip.result.folder, "the result"))
    return sentence(problem) if problem else ""


def not_evaluated(scene: bpy.types.Scene) -> str:
    """Say what was done by hand to the sensors since they were placed or evaluated; empty if nothing was."""
    edits = sensor_edits(scene)
    return f"{edits} Press Evaluate Sensors, or undo." if edits else ""


def no_sensors(scene: bpy.types.Scene) -> str:
    """Return that the scene has no sensors, or ""."""
    return "" if labelled_sensors(scene) else NO_SENSORS


def is_changed(scene: bpy.types.Scene) -> bool:
    """Return whether there is a placement that is known not to be of the scene as it is now."""
    return not no_placement(scene) and any(text != NOT_COMPARED for text in doubts(scene))


def doubts(scene: bpy.types.Scene) -> list[str]:
    """Return why the placement is not, or may not be, of the scene as it is now."""
    return [text for text in (stale_placement(scene), sensor_edits(scene)) if text]


def sensor_edits(scene: bpy.types.Scene) -> str:
    """Return in a sentence what was done by hand to the sensors, hidden or not, since the placement, or ""."""
    text = scene.seip.result.record
    placed = {sensor.id: sensor for sensor in parsed_record(text).sensors} if text else {}
    present = labelled_sensors(scene, hidden=True)
    edits = {
        "moved": [label for label in present if label in placed and not _is_same(present[label], placed[label])],
        "deleted": [label for label in placed if label not in present],
        "added": [label for label in present if label not in placed],
    }
    parts = [f"{', '.join(labels)} {edit}" for edit, labels in edits.items() if labels]
    return f"By hand: {'; '.join(parts)}." if parts else ""


def same_pose(one: tuple[Float, Float], other: tuple[Float, Float]) -> bool:
    """Return whether two poses, each a position (3,) and a rotation (3, 3), are equal within single precision."""
    tolerance = POSE_TOLERANCE * max(1.0, float(np.abs(other[0]).max()))
    same_position = np.allclose(one[0], other[0], rtol=0, atol=tolerance)
    return same_position and np.allclose(one[1], other[1], rtol=0, atol=POSE_TOLERANCE)


def _is_same(sensor: bpy.types.Object, recorded: RecordedSensor) -> bool:
    try:
        pose = pose_of(sensor)
    except SeipError:  # its transform is degenerate
        return False
    recorded_pose = np.array(recorded.local_m), recorded.orientation
    return same_pose(pose, recorded_pose) and sensor.get(contract.SENSOR) == recorded.sensor


def active_sensor(scene: bpy.types.Scene) -> bpy.types.Object:
    """Return the empty of the sensor that is active in the list, or raise a `SeipError`."""
    label = scene.seip.result.active_label()
    empty = placed_sensors(scene).get(label)
    if empty is None:
        raise SeipError(f"the sensor {label} is no longer in the scene: undo, or place again")
    return empty
