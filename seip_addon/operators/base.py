"""Base classes of operators: error reports, and long work that can be stopped."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Generic, TypeVar

import bpy

from .. import scene_status
from ..background import Background
from ..core.errors import SeipError
from ..core.progress import Progress, finish
from ..session import RunningWork, scene_of, session

Result = TypeVar("Result")
Outcome = set[str]

PERIOD = 0.1
"""Seconds between two looks at work that is under way."""
PATIENCE = 3.0
"""Seconds at most that Blender waits for work to stop before it ends: what cannot be stopped is left to itself."""


def attempt(operator: bpy.types.Operator, work: Callable[[], None]) -> Outcome:
    """Do something, and report a user's mistake, or a package that is gone, instead of raising it."""
    try:
        work()
    except SeipError as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    except ImportError as error:  # some come only when they are needed
        operator.report({"ERROR"}, f"a package of the extension is missing or broken ({error}): install its zip again")
        return {"CANCELLED"}
    return {"FINISHED"}


def begun(steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Do work up to its first report at once, and return the rest of it: what touches Blender's data comes first."""
    next(steps)
    return steps


class ForReadyScene:
    """Mixin that enables an operator only where the scene has what any computation needs."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Tell whether it works, and why not."""
        sentence = scene_status.obstacle(context.scene)
        if sentence:
            cls.poll_message_set(sentence)  # type: ignore[attr-defined]  # of Blender's operators
        return not sentence


class LongWork(Generic[Result]):
    """A mixin for operators with work of more than an instant.

    From a script, or where there is no window, `execute` does it at once. A
    click does it in a thread: Blender stays responsive, the panel shows how far
    it is, and its Stop button stops it within a tenth of a second. Keys are left
    to Blender: Esc ends an animation that plays, or a drag, and no computation.
    """

    bl_options = {"REGISTER", "UNDO"}
    stopped = "stopped; nothing was changed"
    """What is reported of work that was stopped."""

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, Result]:
        """Read what is needed from the scene and return the work.

        It touches neither Blender's data nor what `state` holds: it returns its result, which nobody looks at if the
        work is stopped.
        """
        raise NotImplementedError

    def conclude(self, scene: bpy.types.Scene, result: Result) -> None:
        """Take the result over, on the main thread: write it into the scene, have `state` hold it, and report it."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Do the work at once."""
        scene = context.scene
        return attempt(self, lambda: self.conclude(scene, finish(self.prepare(scene))))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Begin the work in a thread."""
        if bpy.app.background:
            return self.execute(context)
        outcome = attempt(self, lambda: self._begin(context))
        return {"RUNNING_MODAL"} if outcome == {"FINISHED"} else outcome

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """Look how far the work is, and write its result once it is done."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._running is not session.running or self._running.stop:
            self._end(context)
            self.report({"INFO"}, self.stopped)  # type: ignore[attr-defined]  # of Blender's operators
            return {"CANCELLED"}
        if not self._running.work.ended:
            _redraw(context)
            return {"PASS_THROUGH"}
        self._end(context)
        return attempt(self, lambda: self.conclude(scene_of(self._scene), self._running.work.result()))

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop because Blender ends, closes the window or opens another file; no thread may outlive its data."""
        self._end(context)
        self._running.work.join(PATIENCE)

    def _begin(self, context: bpy.types.Context) -> None:
        if session.running is not None:
            raise SeipError("other work is under way: wait for it, or stop it with the button beside its bar")
        self._scene = context.scene.session_uid
        name = type(self).bl_idname  # type: ignore[attr-defined]  # of Blender's operators; as panels know it: the instance's own is another spelling, SEIP_OT_…
        self._running = session.running = RunningWork(name, Background(self.prepare(context.scene)))
        self._running.timer = context.window_manager.event_timer_add(PERIOD, window=context.window)
        context.window_manager.modal_handler_add(self)

    def _end(self, context: bpy.types.Context) -> None:
        _put_away(self._running)
        _redraw(context)


def _put_away(running: RunningWork) -> None:
    running.work.stop()
    if running.timer is not None:
        bpy.context.window_manager.event_timer_remove(running.timer)
        running.timer = None
    if session.running is running:
        session.running = None


def _redraw(context: bpy.types.Context) -> None:
    """Have the sidebars of all viewports drawn anew, and not what the viewports show: that may take long."""
    areas = (area for window in context.window_manager.windows for area in window.screen.areas)
    for region in (region for area in areas if area.type == "VIEW_3D" for region in area.regions):
        if region.type == "UI":
            region.tag_redraw()


class SEIP_OT_stop(bpy.types.Operator):
    """Stop the work that is under way"""

    bl_idname = "seip.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Tell whether there is anything to stop."""
        if session.running is None:
            cls.poll_message_set("nothing is under way")
        return session.running is not None

    def execute(self, _context: bpy.types.Context) -> Outcome:
        """Ask the work to stop."""
        if session.running is not None:
            session.running.stop = True
        return {"FINISHED"}


CLASSES = (SEIP_OT_stop,)


def detach() -> None:
    """Stop what is under way: Blender drops its operator with the add-on, and asks it nothing."""
    if session.running is not None:
        running = session.running
        _put_away(running)
        running.work.join(PATIENCE)
