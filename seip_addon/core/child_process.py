"""Programs that work for this one in a process of their own, and end with whoever waits for them."""

import os
import subprocess
import time
from collections.abc import Callable, Generator, Sequence
from pathlib import Path

from .progress import REPORT_INTERVAL, Progress


def exit_status(command: Sequence[str], seconds: float) -> int | None:
    """Run a program without output and return its exit status, None where it takes longer than some seconds.

    Raises
    ------
    OSError
        It cannot be started.
    """
    try:
        process = subprocess.run(  # noqa: S603  # callers name their own programs
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
    return process.returncode


def run_logged(
    command: Sequence[str],
    log: Path,
    progress: Callable[[str], Progress],
    *,
    folder: Path | None = None,
    environment: dict[str, str] | None = None,
) -> Generator[Progress, None, int]:
    """Run a program to its end, its output to a file, and return its exit status.

    Parameters
    ----------
    log : path
        The file for standard output and standard error.
    progress : callable
        Returns how far the program is, from what it has said so far.
    folder : path, optional
        To run it in.
    environment : dict of str to str, optional
        What the environment has beside that of this process.

    Yields
    ------
    Progress
        Ten times a second; the program is ended when this is closed.

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
