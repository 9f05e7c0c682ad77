"""Base classes of operators: error reports, and modal operators whose work runs in a thread and can be stopped.

`tests/addon/test_wrong_states.py` shows its use.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from typing import Any, TypeVar

import bpy

from ..core.base.acceptance import Acceptance
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, finish, progress_line, reporter
from . import scene_status
from .scene_status import no_placement
from .session import RunningWork, scene_of, session

REPORT_WIDTH = 72
"""Letters in a line of an error."""
TIMER_INTERVAL = 0.1
"""Seconds between timer events while work is running."""
SHOW_INTERVAL = 1.0
"""Seconds after which the time is shown again: Blender then draws its whole window, which without a GPU takes as long
as many steps of a search."""
JOIN_TIMEOUT = 3.0
"""Maximum seconds that Blender waits for the thread when it closes; a thread that does not stop is abandoned."""


Result = TypeVar("Result")


Outcome = set[str]


Obstacles = tuple[Callable[[bpy.types.Scene], str], ...]


Job = Generator[Generator[Progress, None, Any], tuple[bpy.types.Scene, Any], None]
"""See `LongWork.job`."""


def attempt(operator: bpy.types.Operator, work: Callable[[], None]) -> Outcome:
    """Call a function, report its `SeipError` or `ImportError` to the user, and return the operator's result set."""
    try:
        work()
    except SeipError as error:
        _report(operator, str(error))
        return {"CANCELLED"}
    except ImportError as error:  # some packages are imported on first use
        _report(operator, f"a package of the extension is missing or broken ({error}): install its zip again")
        return {"CANCELLED"}
    return {"FINISHED"}


def _report(operator: bpy.types.Operator, text: str) -> None:
    """Report an error; Blender shows it in a window of its own, as wide as its longest line."""
    operator.report({"ERROR"}, text if bpy.app.background else "\n".join(textwrap.wrap(text, REPORT_WIDTH)))


def started(steps: Generator[Progress, None, Result]) -> Generator[Progress, None, Result]:
    """Run a generator to its first yield and return it, so that what reads Blender's data runs on the main thread."""
    next(steps)
    return steps


class Conditional:
    """Mixin for operators that are disabled for a reason, which their tooltip states."""

    obstacles: Obstacles = ()
    """Functions that return a reason why the operator is disabled in a scene, or ""."""
    bl_idname: str
    bl_label: str

    def __init_subclass__(cls) -> None:
        """Name an operator by its class: ``SEIP_OT_load_traffic`` is ``seip.load_traffic`` and *Load Traffic*."""
        name = cls.__name__.removeprefix("SEIP_OT_")
        if name != cls.__name__:
            cls.bl_idname = f"seip.{name}"
            cls.bl_label = vars(cls).get("bl_label", name.replace("_", " ").title())

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return the first reason why the operator is disabled, as a sentence; empty if it is enabled."""
        return next(filter(None, (obstacle(context.scene) for obstacle in cls.obstacles)), "")

    def warn(self, sentences: Iterable[str]) -> None:
        """Report warnings."""
        for sentence in sentences:
            self.report({"WARNING"}, sentence)  # type: ignore[attr-defined]  # of Blender's operators

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether the operator is enabled; otherwise the tooltip says why not."""
        reason = cls.why_not(context)
        if reason:
            cls.poll_message_set(reason)  # type: ignore[attr-defined]  # of Blender's operators
        return not reason


class ForReadyScene(Conditional):
    """Mixin that enables an operator only where the scene has all inputs of a computation."""

    obstacles: Obstacles = (scene_status.obstacle,)


class ForPlacement(ForReadyScene):
    """Mixin that enables an operator only where the scene has a placement."""

    obstacles: Obstacles = (*ForReadyScene.obstacles, no_placement)


class ShortWork(Conditional):
    """Mixin for operators that are done at once: an error is reported to the user."""

    def act(self, context: bpy.types.Context) -> None:
        """Do the work, or raise a `SeipError`."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Do the work, and report an error."""
        return attempt(self, lambda: self.act(context))


class LongWork(Conditional):
    """Mixin for operators with long computations.

    From a script, or without a window, `execute` blocks until the result is
    there. From the interface the operator is modal and computes in a thread:
    Blender stays responsive, the panel shows the progress, and its Stop button
    stops the work within a tenth of a second. Esc is left to Blender.
    """

    bl_options = {"REGISTER", "UNDO"}
    stopped_message = "stopped; nothing was changed"
    acceptance: Acceptance | None = None
    """Set by an operator whose search a user can end with the best result so far."""

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the inputs from a scene, yield the work, and store and report its result; runs on the main thread.

        The work runs in a thread: it must touch neither Blender's data nor `session`, only return its result, which
        is discarded if the work is stopped. ``yield`` returns the scene, in whose place undo may have put another
        Python object, and the result.
        """
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Do the work and wait for it."""

        def act() -> None:
            job = self.job(context.scene)
            _conclude(job, context.scene, finish(next(job)))

        return attempt(self, act)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event | None) -> Outcome:
        """Start the work in a thread."""
        if bpy.app.background:
            return self.execute(context)
        outcome = attempt(self, lambda: self._start(context))
        return {"RUNNING_MODAL"} if outcome == {"FINISHED"} else outcome

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """Show the progress on timer events, and conclude once the work has ended."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._running is not session.running or self._running.stopped:
            self._end(context)
            self.report({"INFO"}, self.stopped_message)  # type: ignore[attr-defined]  # of Blender's operators
            return {"CANCELLED"}
        if not self._running.ended:
            self._report(self._running.progress)
            return {"PASS_THROUGH"}
        self._end(context)
        return attempt(self, lambda: _conclude(self._job, scene_of(self._scene), self._running.result()))

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop because Blender quits, closes the window or opens another file, so that no thread outlives its data."""
        self._end(context)
        self._running.join(JOIN_TIMEOUT)

    def _start(self, context: bpy.types.Context) -> None:
        if session.running is not None:
            raise SeipError("other work is under way: wait for it, or stop it with the button beside its bar")
        self._scene = context.scene.session_uid
        name = type(self).bl_idname  # of the class, as panels spell it: Blender gives the instance's as SEIP_OT_…
        self._job = self.job(context.scene)
        self._running = session.running = RunningWork(name, next(self._job), self.acceptance)
        self._report = reporter(self._show, SHOW_INTERVAL)
        self._running.timer = context.window_manager.event_timer_add(TIMER_INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)

    def _show(self, progress: Progress, duration: str) -> None:
        """Show the line of progress in the status bar, as the sidebar may be closed, and in the sidebar."""
        self._running.shown = (progress, duration)
        line = progress_line(progress, duration)
        _say(bpy.context, f"{type(self).bl_label}: {line} (to stop it: Object ▸ SEIP ▸ Stop, or × in the sidebar)")
        _redraw(bpy.context)

    def _end(self, context: bpy.types.Context) -> None:
        _stop(self._running)
        _say(context, None)
        _redraw(context)


def _conclude(job: Job, scene: bpy.types.Scene, result: object) -> None:
    """Give a job the result of its work."""
    with suppress(StopIteration):
        job.send((scene, result))


def _say(context: bpy.types.Context, text: str | None) -> None:
    """Show a text in the status bar, or Blender's own again."""
    if context.workspace is not None:
        context.workspace.status_text_set(text)


def _stop(running: RunningWork[Any]) -> None:
    """Ask work to stop, remove its timer and free the session for other work."""
    running.stop()
    if running.timer is not None:
        bpy.context.window_manager.event_timer_remove(running.timer)
        running.timer = None
    if session.running is running:
        session.running = None


def _redraw(context: bpy.types.Context) -> None:
    """Redraw the sidebars of all viewports and the preferences, but not the viewports, which may take long."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in {("VIEW_3D", "UI"), ("PREFERENCES", "WINDOW")}:
                    region.tag_redraw()


class SEIP_OT_stop(ShortWork, bpy.types.Operator):
    """Stop the work that is under way"""

    obstacles = (lambda _: "nothing is under way" if session.running is None else "",)

    def act(self, _context: bpy.types.Context) -> None:
        """Ask the work to stop."""
        if session.running is not None:
            session.running.stop()


class SEIP_OT_accept(ShortWork, bpy.types.Operator):
    """End the search with the best placement found so far"""

    bl_label = "Use Best So Far"

    obstacles = (lambda _: "" if is_searching() else "no search for a placement is running",)

    def act(self, _context: bpy.types.Context) -> None:
        """Ask the search to end."""
        if session.running is not None and session.running.acceptance is not None:
            session.running.acceptance.accept()


def is_searching() -> bool:
    """Return whether a search for a placement is running, whose best one so far can be used."""
    running = session.running
    return running is not None and running.acceptance is not None and running.acceptance.searching


def forget() -> None:
    """Stop running work: when the add-on is disabled Blender drops its modal operators without calling `cancel`."""
    if (running := session.running) is not None:
        _stop(running)
        running.join(JOIN_TIMEOUT)


def select_alone(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Select an object, and nothing else, and make it active."""
    for other in context.selected_objects:
        other.select_set(state=False)
    obj.select_set(state=True)
    context.view_layer.objects.active = obj
