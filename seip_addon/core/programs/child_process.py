"""Child processes, which end together with the code that waits for them."""

import os
import subprocess
import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

from ..base.progress import REPORT_INTERVAL, Progress


def run_logged(
    command: Sequence[str],
    log: Path,
    progress: Callable[[str], Progress],
    *,
    folder: Path | None = None,
    environment: dict[str, str] | None = None,
) -> Generator[Progress, None, int]:
    """Run a program to its end with its output written to a file, and return its exit status.

    Parameters
    ----------
    log : path
        File for standard output and standard error.
    progress : callable
        Function that returns the progress from the output so far.
    folder : path, optional
        Working folder of the program.
    environment : dict of str to str, optional
        Environment variables to set in addition to those of this process.

    Yields
    ------
    Progress
        Progress, ten times a second. Closing the generator ends the program.

    Raises
    ------
    OSError
        It cannot be started.
    """
    with log.open("wb") as lines:
        process = subprocess.Popen(  # noqa: S603  # callers name their own programs
            command,
            cwd=folder,
            env=os.environ | (environment or {}),
            stdin=subprocess.DEVNULL,
            stdout=lines,
            stderr=subprocess.STDOUT,
        )
    try:
        while process.poll() is None:
            yield progress(log.read_text(encoding="utf-8", errors="replace"))
            time.sleep(REPORT_INTERVAL)
    finally:
        process.kill()
        process.wait()
    return process.returncode
