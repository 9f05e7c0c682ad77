"""Coverage in traffic: computed again for the vehicles of the current frame, as the timeline moves.

A handler notes that the frame changed; a timer casts the few rays towards vehicles
and colours the road again. Frames that come sooner than that is done are left out.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import live_scan
from .core.choosing.robustness.traffic_instants import obstacles_of
from .core.choosing.robustness.visibility_in_traffic import PosesInTraffic
from .core.errors import SeipError
from .scene.coverage_colours import colour_coverage, show_seen_by
from .scene.write import ASPECT, coverage_of
from .session import CoverageInTraffic, SceneState, scene_of, session


def start(scene: bpy.types.Scene, state: SceneState, visibility: PosesInTraffic) -> None:
    """Show the coverage of a scene's frames from now on."""
    stop()
    obj = coverage_of(scene)
    aspect = None if obj is None else obj.get(ASPECT)
    session.in_traffic = CoverageInTraffic(scene.session_uid, state, visibility, aspect)
    bpy.app.handlers.frame_change_post.append(_frame_changed)
    update()


def stop() -> None:
    """Show the coverage of the empty road again, where it can be shown."""
    shown = session.in_traffic
    if shown is None:
        return
    forget()
    try:
        scene = scene_of(shown.scene)
        if shown.state.record == scene.seip.result.record:
            _, solution = shown.state.placed()
            show_seen_by(scene, solution.deployment.seen_by)
            if shown.aspect is not None:
                colour_coverage(scene, shown.aspect)
    except SeipError:
        return  # the scene, or its coverage, is gone: there is nothing to restore


def update() -> None:
    """Cast the rays towards the vehicles of the current frame and colour the road again."""
    shown = session.in_traffic
    if shown is None:
        return
    try:
        _update(shown, scene_of(shown.scene))
        shown.problem = ""
    except SeipError as error:
        shown.problem = str(error)


def _update(shown: CoverageInTraffic, scene: bpy.types.Scene) -> None:
    if shown.state.record != scene.seip.result.record:
        raise SeipError("this is another placement: turn this off and on again")
    traffic = session.traffic.get(scene.session_uid)
    if traffic is None:
        raise SeipError("the traffic is no longer loaded: load it again")
    run = traffic.trajectories
    seen_by = shown.visibility.seen_by(obstacles_of(run, run.at(live_scan.now(scene))))
    shown.coverage = float(np.count_nonzero(seen_by)) / len(seen_by)
    show_seen_by(scene, seen_by, moved=True)  # returns are those of the empty road


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _frame_changed(scene: bpy.types.Scene, *_: object) -> None:
    """Have a look soon, not at once: looking changes the scene, which must not be while it is evaluated or rendered."""
    shown = session.in_traffic
    waits = bpy.app.timers.is_registered(update) or bpy.app.is_job_running("RENDER")
    if shown is not None and scene.session_uid == shown.scene and not waits:
        bpy.app.timers.register(update, first_interval=0.0)


def forget() -> None:
    """Follow no timeline: another file is opened, or the add-on is disabled."""
    session.in_traffic = None
    if _frame_changed in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.remove(_frame_changed)
    if bpy.app.timers.is_registered(update):
        bpy.app.timers.unregister(update)
