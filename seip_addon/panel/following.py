"""Live coverage: computed again whenever a sensor is moved.

A handler notes that something moved; a timer, a moment later, casts the rays of only those sensors and colours the road
again.
"""

from __future__ import annotations

from collections.abc import Generator

import bpy
import numpy as np

from ..core.base.arrays import Integer
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.returns_summary import returns_text
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.visibility.visibility_model import visibility_model
from ..core.workflows.returns import SensorReturns
from ..scene import contract
from ..scene.sensors import read_sensors
from ..scene.write import show_seen_by
from . import preferences
from .layout import draw_sentence
from .scene_status import same_pose, sensor_edits
from .session import Followed, FollowedSensors, SceneState, scene_of, session
from .survey import with_placement
from .work import ForPlacement, Job, LongWork, Outcome

DELAY = 0.02  # seconds from a movement to the look at it: a drag reports many


def stop() -> None:
    """Stop updating coverage for moved sensors."""
    session.following = None
    if bpy.app.timers.is_registered(update):
        bpy.app.timers.unregister(update)


def update() -> None:
    """Cast the rays of the sensors that moved and colour the road again."""
    followed = session.following
    if followed is None:
        return
    try:
        scene = scene_of(followed.scene)
        if followed.state.record != scene.seip.result.record:  # undo has brought back another placement
            stop()
            return
        _update(followed, scene)
        followed.problem = ""
    except SeipError as error:
        followed.problem = str(error)


def _update(followed: FollowedSensors, scene: bpy.types.Scene) -> None:
    if followed.state.watch.changed:
        raise SeipError("the scene has changed: place again, or turn this off")
    sensors = {sensor.label: sensor for sensor in read_sensors(scene, preferences.catalogue())}
    for label in [label for label in followed.sensors if label not in sensors]:
        del followed.sensors[label]
    for label, sensor in sensors.items():
        if label not in followed.sensors or not _same(followed.sensors[label][0], sensor):
            seen = followed.visibility.see(sensor.model, sensor.xyz, sensor.orientation)
            followed.sensors[label] = (sensor, seen, None if followed.returns is None else followed.returns.of(sensor))
    mounted, rows, returns = zip(*followed.sensors.values(), strict=True) if followed.sensors else ((), (), ())
    seen_by: Integer = np.sum(rows, axis=0, dtype=np.int64)
    followed.coverage = float(np.count_nonzero(seen_by)) / len(seen_by)
    pedestrians = None
    if followed.returns is not None:
        followed.summary = followed.returns.summary(mounted, returns)
        pedestrians = followed.returns.near_targets(returns)
    show_seen_by(scene, seen_by, pedestrians)


def _same(one: MountedSensor, other: MountedSensor) -> bool:
    return same_pose((one.xyz, one.orientation), (other.xyz, other.orientation)) and one.model.key == other.model.key


def _on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Have a look soon where a sensor moved, came or went; never at once, as looking changes the scene."""
    if session.following is None or scene.session_uid != session.following.scene:
        return
    objects = [update for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    moved = any(update.is_updated_transform and contract.SENSOR in update.id for update in objects)
    rebuilt = any(not (update.is_updated_transform or update.is_updated_geometry) for update in objects)
    if moved or rebuilt:
        _update_soon()


def _update_soon(*_: object) -> None:
    """Have a look soon; undo and redo name no object that they bring back."""
    if session.following is not None and not bpy.app.timers.is_registered(update):
        bpy.app.timers.register(update, first_interval=DELAY)


HANDLERS = (("depsgraph_update_post", _on_update), ("undo_post", _update_soon), ("redo_post", _update_soon))
forget = stop  # another file is opened, or the add-on is disabled


class SEIP_OT_follow_sensors(ForPlacement, LongWork, bpy.types.Operator):
    """Toggle live coverage while sensors are moved or turned by hand"""

    bl_label = "Follow Moved Sensors"
    bl_options = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """End it at once, or begin in a thread."""
        return self.execute(context) if session.following is not None else super().invoke(context, event)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """End it, or begin."""
        if session.following is not None:
            stop()
            return {"FINISHED"}
        return super().execute(context)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and begin to follow."""
        scene, followed = yield _set_up(scene.session_uid, with_placement(scene))
        session.of(scene).state, session.following = followed.state, followed
        update()


def _set_up(scene: int, finding: Generator[Progress, None, SceneState]) -> Generator[Progress, None, FollowedSensors]:
    """Return the sensors of a placement with their visibility; those that are at no candidate pose are cast later."""
    state = yield from finding
    yield Progress(0, 0, "getting ready to cast")
    settings, (_, solution) = state.layout.settings, state.placed()
    deployment = solution.deployment
    visibility = visibility_model(state.layout.site, settings.visibility, settings.engine)
    returns = None if deployment.returns is None else SensorReturns(state.layout, solution.objective)
    seen = zip(deployment.sensors, deployment.rows, strict=True)
    known: dict[str, Followed] = {
        one.label: (one, row, None if returns is None else returns.of(one)) for one, row in seen if one.pose is not None
    }
    return FollowedSensors(scene, state, visibility, returns, known)


def draw_followed(layout: bpy.types.UILayout, following: FollowedSensors) -> None:
    """Draw the coverage of the sensors as they are now."""
    if following.problem:
        draw_sentence(layout, following.problem, icon="ERROR", alert=True)
        return
    layout.label(text=_followed_text(following), icon="HIDE_OFF")
    if edits := sensor_edits(bpy.context.scene):
        draw_sentence(layout, edits)


def _followed_text(following: FollowedSensors) -> str:
    """Return the quality of the placement and of the sensors as they are now, by what the placement was chosen for."""
    _, solution = following.state.placed()
    placed = solution.deployment
    if placed.returns is None or following.summary is None:
        before, now, what = f"{placed.coverage:.1%}", f"{following.coverage:.1%}", "of the road"
    else:
        before, now = returns_text(placed.returns.typical), returns_text(following.summary.typical)
        what = "returns"
    return f"{now} {what}" if before == now else f"{before} → {now} {what}"
