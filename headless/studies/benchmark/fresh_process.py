"""Work run in a fresh process, so that earlier work does not affect its memory.

`multiprocessing` is not used: it passes on the search path, where bpy has put Blender's scripts before its own package.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

Result = TypeVar("Result")

_ROOT = Path(__file__).resolve().parents[3]


def in_fresh_process(work: Callable[[], Result]) -> Result:
    """Return the result of ``work``, a picklable function, run in a new process."""
    command = [sys.executable, "-m", __name__]
    outcome = subprocess.run(command, input=pickle.dumps(work), stdout=subprocess.PIPE, check=True, cwd=_ROOT)  # noqa: S603 - our own interpreter and module
    result: Result = pickle.loads(outcome.stdout)  # noqa: S301 - written by this very module
    return result


def _main() -> None:
    answer = os.dup(1)
    os.dup2(2, 1)  # what libraries print must not get into the answer
    result = pickle.load(sys.stdin.buffer)()  # noqa: S301 - written by this very module
    with os.fdopen(answer, "wb") as file:
        pickle.dump(result, file)


if __name__ == "__main__":
    _main()
