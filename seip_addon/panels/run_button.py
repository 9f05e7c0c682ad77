"""Button of a long operator, which shows its progress while it runs."""

from __future__ import annotations

import time

import bpy

from .. import scene_status
from ..session import session


def draw_run(layout: bpy.types.UILayout, operator: str, icon: str = "NONE", text: str | None = None) -> None:
    """Draw an operator's button, or how far its work is with a button to stop it; the next step's is emphasised."""
    running = session.running
    if running is None or not is_running(operator):
        row = layout.row(align=True)
        row.active_default = scene_status.next_step(bpy.context.scene) == operator
        row.operator(operator, icon=icon, text=text)
        return
    progress = running.work.progress
    column = layout.column(align=True)
    row = column.row(align=True)
    row.progress(factor=progress.done / progress.total if progress.total else 0.0, text=progress.what)
    row.operator("seip.stop", text="", icon="X")
    if running.acceptance is not None and running.acceptance.searching:
        column.operator("seip.accept", icon="CHECKMARK")
    column.label(text=times_in_words(time.monotonic() - running.began, running.work.seconds_left))


def is_running(operator: str) -> bool:
    """Return whether an operator's work is under way."""
    return session.running is not None and session.running.operator == operator


def in_words(seconds: float) -> str:
    """Return a time as people say it, no more precisely than they care."""
    if seconds < 100:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def times_in_words(passed: float, left: float | None) -> str:
    """Return how long work has taken, and how long it will take still where that is known."""
    return in_words(passed) if left is None else f"{in_words(passed)}, {in_words(left)} left"
