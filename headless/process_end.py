"""End of a command's process, without freeing Blender's module.

Import it before bpy, so that its function runs after all others that are registered with `atexit`.
"""

import atexit
import os
import shutil
import sys
from pathlib import Path

_ENDS: list[tuple[int, Path]] = []


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
