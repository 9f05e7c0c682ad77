"""Button of a long operator, which shows its progress while it runs.

`tests/window/tutorial.py` shows its use.
"""

from __future__ import annotations

import bpy

from .. import scene_status
from ..core.progress import progress_line
from ..session import session
from .wrapped_text import draw_sentence


def draw_run(
    layout: bpy.types.UILayout,
    operator: str,
    icon: str = "NONE",
    text: str | None = None,
    *,
    in_one_row: bool = False,
) -> None:
    """Draw an operator's button, or in its place the progress of its work; the button of the next step is emphasised.

    The progress is a row that takes the place of the button, with the time in its bar, and a sentence below unless
    there is only one row.
    """
    running = session.running
    row = layout.row(align=True)
    if running is None or not is_running(operator):
        row.active_default = scene_status.next_step(bpy.context.scene) == operator
        row.operator(operator, icon=icon, text=text)
        return
    progress, duration = running.shown
    row.progress(factor=progress.done / progress.total if progress.total else 0.0, text=duration)
    if running.acceptance is not None and running.acceptance.searching:
        row.operator("seip.accept", text="", icon="CHECKMARK")
    row.operator("seip.stop", text="", icon="X")
    if in_one_row:
        return
    line = progress_line(progress)
    draw_sentence(layout, f"{line[:1].upper()}{line[1:]}")


def is_running(operator: str) -> bool:
    """Return whether an operator's work is under way."""
    return session.running is not None and session.running.operator == operator
