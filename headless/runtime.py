"""Runtime of the batch commands: arguments, scene file, exit status, progress bar.

The same file runs as ``blender -b … -P headless/x.py -- arguments`` in the
real program and as ``python -m headless.x arguments`` on the bpy module.

`tests/headless/test_runtime.py` shows its use.
"""

import logging
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn, TypeVar

# Before numpy is loaded: products shared out to threads depend on their number in the last digit, and take many times
# as long where other work is on the same cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from headless.process_end import end_without_freeing, handle
from headless.system_libraries import complaint, missing_libraries

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish, progress_line, reporter
from seip_addon.core.storage.files import locked
from seip_addon.scene.interrupts import SIGNALS, held_signals

try:
    with held_signals():
        import bpy
    import defusedxml  # noqa: F401  # first of what the commands stand on, to be missed here rather than anywhere
    import highspy  # noqa: F401
    import matplotlib as mpl  # noqa: F401
    import pulp  # noqa: F401
    import shapely  # noqa: F401
    from tqdm import tqdm

    from seip_addon.scene.blend_file import open_blend
except ModuleNotFoundError as error:
    sys.exit(
        f"error: {sys.executable} has no package {error.name!r}: use .venv/bin/python, set up by `make environment`, "
        "or in Blender install the extension that `make extension` builds"
    )
except ImportError:
    missing = missing_libraries()
    if not missing:
        raise
    sys.exit(f"error: {complaint(missing)}")

Result = TypeVar("Result")

EXIT_STOPPED = 130  # what a shell reports of a command that was stopped by Ctrl-C
SECONDS_BETWEEN_LINES = float(os.environ.get("SEIP_SECONDS_BETWEEN_LINES", "10"))  # of progress, in a log
SECONDS_BETWEEN_BARS = 0.1  # of progress, in a terminal
LOG = logging.getLogger("headless")  # progress and warnings of commands and modules; results go through `print_line`
_LOCKS = ExitStack()  # of the folders of results
_LOCKED: set[Path] = set()  # these folders


def in_blender() -> bool:
    """Return whether the code runs inside Blender, not in Python with the bpy package."""
    return not bpy.app.module


def why_offline() -> str:
    """Return why nothing may be downloaded, or "": Blender asks its user; Python has been told by the command."""
    if in_blender() and not bpy.app.online_access:
        return "Blender may not go online: start it with --online-mode, or switch on Allow Online Access in Preferences"
    return ""


def arguments(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command's own arguments: in Blender those after ``--``, else all but the first."""
    given = list(sys.argv if argv is None else argv)
    if not in_blender():
        return given[1:]
    return given[given.index("--") + 1 :] if "--" in given else []


def open_scene(path: Path | None) -> None:
    """Open the named .blend; in Blender without a name stay with the scene that is open.

    Raises
    ------
    SeipError
        There is nothing to open.
    """
    if path is not None:
        open_blend(path)
    elif not (in_blender() and bpy.data.filepath):
        raise SeipError("no scene: name a .blend")


def check_folder(folder: Path) -> None:
    """Check that a folder can be written, and lock it against other runs until this process ends.

    The folder is made to be locked. Where nothing is written to it, `run` removes it again when the command ends.

    Raises
    ------
    SeipError
        It cannot, or another run does.
    """
    if folder.resolve() not in _LOCKED:
        _LOCKS.enter_context(locked(folder, folder=True))
        _LOCKED.add(folder.resolve())


@contextmanager
def incomplete_if_interrupted(folder: Path) -> Iterator[None]:
    """Add to a Ctrl-C within the block that the folder is incomplete: its files are whole, but some are missing."""
    try:
        yield
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(f"stopped while writing: the results in {folder} are incomplete") from stop


def print_line(text: str) -> None:
    """Print a line of the command's results on standard output, unbuffered."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def warn(messages: Iterable[str]) -> None:
    """Log what a user should know before trusting the results."""
    for message in messages:
        LOG.warning(message)


class _Console(logging.Handler):
    """Log records on standard output, above a bar that may be shown: warnings begin with the word."""

    def emit(self, record: logging.LogRecord) -> None:
        prefix = "warning: " if record.levelno >= logging.WARNING else ""
        tqdm.write(f"{prefix}{record.getMessage()}", file=sys.stdout)
        sys.stdout.flush()


if not LOG.handlers:
    LOG.addHandler(_Console())
    LOG.setLevel(logging.INFO)


def run(main: Callable[[list[str]], None]) -> NoReturn:
    """Run a command and end the process: 0, 1 after a user's mistake, 130 after Ctrl-C, 143 when terminated.

    Parameters
    ----------
    main : callable
        The command, called with its own arguments. Exceptions other than
        `SeipError` and `KeyboardInterrupt` are defects and show their traceback.
    """
    try:
        _run(main)
    except BaseException as end:
        code = end.code if isinstance(end, SystemExit) else 1
        if not in_blender():
            end_without_freeing(code if isinstance(code, int) else int(code is not None), Path(bpy.app.tempdir))
        raise


def _run(main: Callable[[list[str]], None]) -> NoReturn:
    received: list[int] = []

    def stop(which: int, _frame: FrameType | None) -> NoReturn:
        # An exception, so that half-written files are removed on the way out.
        received.append(which)
        raise KeyboardInterrupt if which == signal.SIGINT else SystemExit(128 + which)

    signal.signal(signal.SIGINT, stop)  # Blender leaves SIGINT to the system
    handle(SIGNALS[1:], stop)
    try:
        try:
            main(refuse_pipes(arguments()))
        finally:
            _LOCKS.close()
            _LOCKED.clear()
    except KeyboardInterrupt as interrupt:
        _end(EXIT_STOPPED, str(interrupt) or "stopped, no result written")
    except Exception as error:
        if received:  # libraries in C that call Python turn the exception of a signal into one of their own
            _end(128 + received[0], "stopped")
        if isinstance(error, SeipError):
            _end(1, f"error: {error}")
        if isinstance(error, MemoryError):
            _end(1, "error: there is not enough memory: choose a coarser grid, fewer candidates or smaller files")
        raise
    _end(0)


def refuse_pipes(words: list[str]) -> list[str]:
    """Return the arguments of a command, if none is a pipe or a device: readers go back and forth in their files."""
    for word in words:
        path = Path(word.partition("=")[2] if word.startswith("--") else word)
        with suppress(OSError, ValueError):  # longer than a name can be, or with a null character
            kind = path.stat().st_mode
            if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)) and path != Path(os.devnull):
                raise SeipError(f"{path} is neither a file nor a folder: write what it holds to a file, and name that")
    return words


def finish_with_bar(steps: Generator[Progress, None, Result]) -> Result:
    """Run work to its end under a bar of its own, and return its result."""
    with progress_bar() as report:
        return finish(steps, report)


@contextmanager
def progress_bar() -> Iterator[Callable[[Progress], None]]:
    """Yield a callable for `finish` that shows work done and time left on standard error.

    A terminal has one line (`progress_line`), which stays in its place, with a bar where the length of the work is
    known. A log gets such a line whenever a search has found a better placement, and otherwise every ten seconds, or
    as often as ``SEIP_SECONDS_BETWEEN_LINES`` in the environment says.
    """
    if not sys.stderr.isatty():
        yield reporter(_write_line, SECONDS_BETWEEN_LINES)
        return
    with tqdm(file=sys.stderr, leave=False, bar_format="{desc}") as bar:

        def show(progress: Progress, time: str) -> None:
            line = progress_line(progress, time)
            if bar.ncols and len(line) > bar.ncols:  # rather a shorter phase than no time
                phase = progress.what[: bar.ncols - len(line) - 1]
                line = f"{phase}…{line[len(progress.what) :]}"
            bar.bar_format = "{desc} |{bar}|" if progress.total else "{desc}"
            bar.n, bar.total = progress.done, progress.total or None
            bar.set_description_str(line)

        yield reporter(show, SECONDS_BETWEEN_BARS)


def accepted_by_enter() -> Acceptance | None:
    """Return what Enter in a terminal accepts: the best placement of a search so far; None without a terminal."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stderr.isatty()):
        return None
    acceptance = Acceptance()

    def wait() -> None:
        while sys.stdin.readline() and not acceptance.accepted:
            if acceptance.searching:
                acceptance.accept()

    threading.Thread(target=wait, daemon=True).start()
    LOG.info("press Enter to end the search with the best placement found so far")
    return acceptance


def _write_line(progress: Progress, time: str) -> None:
    """Write a line on progress to a log."""
    sys.stderr.write(f"{progress_line(progress, time)}\n")
    sys.stderr.flush()


def _end(status: int, message: str = "") -> NoReturn:
    if message:
        sys.stderr.write(f"{message}\n")
    sys.stdout.flush()
    sys.stderr.flush()
    sys.exit(status)
