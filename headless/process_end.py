"""End of a command's process, without freeing Blender's module.

Import it before bpy, so that its function runs after all others that are registered with `atexit`.
"""

import atexit
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from seip_addon.scene.interrupts import SIGNALS

_ENDS: list[tuple[int, Path]] = []


def end_now(status: int) -> NoReturn:
    """End the process in the midst of its work, and remove Blender's folder for the session."""
    bpy: Any = sys.modules.get("bpy")
    if bpy is not None:
        shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(status)


def end_on_signals() -> None:
    """Let Ctrl-C and termination end the process at once, until `headless.runtime.run` handles them.

    Nothing has been written until then, and an exception in the midst of an import may be lost or crash Blender.
    """
    handle(SIGNALS, lambda which, _frame: end_now(128 + which))


def handle(signals: Iterable[int], handler: Callable[[int, FrameType | None], object]) -> None:
    """Set the handler of signals that the caller of the process has not switched off, as ``nohup`` does."""
    for number in signals:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def end_without_freeing(status: int, temporary: Path) -> None:
    """End the process with a status at its exit, before Python frees modules.

    Freeing the bpy module never ends if the open scene has a driver with a Python expression.

    Parameters
    ----------
    status : int
        Exit status.
    temporary : Path
        Folder of Blender for the session, which is removed.
    """
    _ENDS.append((status, temporary))


def _end() -> None:
    if _ENDS:
        status, temporary = _ENDS[-1]
        shutil.rmtree(temporary, ignore_errors=True)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


atexit.register(_end)
