"""Button of a long operator, which shows its progress while it runs.

`tests/window/tutorial.py` shows its use.
"""

from __future__ import annotations

import time

import bpy

from .. import scene_status
from ..core.counts import duration_text
from ..session import session
from .sections import BETWEEN, fitting

TWO_BUTTONS = 40.0
"""Width of the buttons beside the progress, pixels at the usual scale of the interface."""


def draw_run(layout: bpy.types.UILayout, operator: str, icon: str = "NONE", text: str | None = None) -> None:
    """Draw an operator's button, or in its place the progress of its work; the button of the next step is emphasised.

    The progress takes one row, as the button does, so that nothing below it moves.
    """
    running = session.running
    row = layout.row(align=True)
    if running is None or not is_running(operator):
        row.active_default = scene_status.next_step(bpy.context.scene) == operator
        row.operator(operator, icon=icon, text=text)
        return
    progress = running.work.progress
    times = times_text(time.monotonic() - running.began, running.work.seconds_left)
    text = fitting(f"{times}{BETWEEN}{progress.what}", TWO_BUTTONS)
    row.progress(factor=progress.done / progress.total if progress.total else 0.0, text=text)
    if running.acceptance is not None and running.acceptance.searching:
        row.operator("seip.accept", text="", icon="CHECKMARK")
    row.operator("seip.stop", text="", icon="X")


def is_running(operator: str) -> bool:
    """Return whether an operator's work is under way."""
    return session.running is not None and session.running.operator == operator


def times_text(passed: float, left: float | None) -> str:
    """Return how long work has taken, and how long it will still take if that is known."""
    return duration_text(passed) if left is None else f"{duration_text(left)} left"
