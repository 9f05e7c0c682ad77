"""The button of long work, which turns into its progress."""

from __future__ import annotations

import time

import bpy

from .. import state


def draw_run(layout: bpy.types.UILayout, operator: str) -> None:
    """Draw an operator's button, or how far its work is with a button to stop it."""
    running = state.running
    if running is None or running.operator != operator:
        layout.operator(operator)
        return
    row = layout.row(align=True)
    progress = running.progress
    factor = progress.done / progress.total if progress.total else 0.0
    seconds = time.monotonic() - running.began
    row.progress(factor=factor, text=f"{progress.what} · {seconds:.0f} s")
    row.operator("seip.stop", text="", icon="X")
