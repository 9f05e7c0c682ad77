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
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn, TypeVar

# Before numpy is loaded: products shared out to threads depend on their number in the last digit, and take many times
# as long where other work is on the same cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from headless.process_end import end_without_freeing
from headless.system_libraries import complaint, missing_libraries

from seip_addon.core.acceptance import Acceptance
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Pace, Progress, finish
from seip_addon.core.storage import files as storage

try:
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
ELAPSED_FORMAT = "{desc} [{elapsed}]"  # how progress of unknown length is shown
STAGES_FORMAT = "{l_bar}{bar}| {n_fmt}/{total_fmt} [{elapsed}]"  # and that of units of unequal length
LOG = logging.getLogger("headless")  # progress and warnings of commands and modules; results go through `print_line`
_LOCKS: dict[Path, int] = {}  # folders that this process has locked, and what holds each lock
_MADE: list[Path] = []  # folders that this process has made for results


def in_blender() -> bool:
    """Return whether the code runs inside Blender, not in Python with the bpy package."""
    return not bpy.app.module


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
    _MADE.extend(storage.check_folder(folder))
    place = folder.resolve()
    if place not in _LOCKS:
        _LOCKS[place] = storage.lock_folder(place)


@contextmanager
def incomplete_if_interrupted(folder: Path, *, continues: bool = False) -> Iterator[None]:
    """Add to a Ctrl-C within the block that the folder is incomplete: its files are whole, but some are missing.

    Parameters
    ----------
    continues : bool
        Whether the same command continues from these files.
    """
    try:
        yield
    except KeyboardInterrupt as stop:
        cure = "; the same command continues from there" if continues else ""
        raise KeyboardInterrupt(f"stopped while writing: the results in {folder} are incomplete{cure}") from stop


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
    signal.signal(signal.SIGINT, signal.default_int_handler)  # Blender leaves SIGINT to the system
    for number in (signal.SIGTERM, signal.SIGHUP):  # end in good order: half-written files are removed on the way out
        signal.signal(number, lambda which, _frame: sys.exit(128 + which))
    try:
        try:
            main(refuse_pipes(arguments()))
        finally:
            _leave_folders()
    except SeipError as error:
        _end(1, f"error: {error}")
    except KeyboardInterrupt as stop:
        _end(EXIT_STOPPED, str(stop) or "stopped, no result written")
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


def _leave_folders() -> None:
    """Unlock the folders of results, and remove those that were made in vain."""
    while _LOCKS:
        storage.unlock_folder(*_LOCKS.popitem())
    storage.remove_empty(_MADE)
    _MADE.clear()


def finish_with_bar(steps: Generator[Progress, None, Result]) -> Result:
    """Run work to its end under a bar of its own, and return its result."""
    with progress_bar() as report:
        return finish(steps, report)


@contextmanager
def progress_bar() -> Iterator[Callable[[Progress], None]]:
    """Yield a callable for `finish` that shows work done and time left on standard error.

    A terminal sees one bar, which stays on its line and restarts where the work does (a smaller count, another
    total); work of unknown length shows what it does and for how long. A log gets a line every ten seconds at most,
    or as often as ``SEIP_SECONDS_BETWEEN_LINES`` in the environment says.
    """
    if not sys.stderr.isatty():
        yield _line_reporter()
        return
    with tqdm(file=sys.stderr, leave=False, mininterval=0.1, maxinterval=0.1, bar_format=ELAPSED_FORMAT) as bar:

        def report(progress: Progress) -> None:
            known = progress.total > 0
            bar.set_description(progress.what, refresh=False)
            bar.bar_format = _format_of(progress)
            if (progress.total or None) != bar.total or (known and progress.done < bar.n):
                bar.total = progress.total or None
                bar.reset()
                bar.initial = bar.n = progress.done if known else 0  # what an earlier run has done took no time
            bar.update(progress.done - bar.n if known else 1)

        yield report


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


def _line_reporter() -> Callable[[Progress], None]:
    """Return what writes a line on progress where `SECONDS_BETWEEN_LINES` have passed since the last one."""
    start = shown = time.monotonic()
    pace = Pace()

    def report(progress: Progress) -> None:
        nonlocal shown
        now = time.monotonic()
        pace.note(progress, now)
        if now - shown < SECONDS_BETWEEN_LINES:
            return
        shown = now
        first = progress.done if pace.first is None else pace.first.done
        timed = progress.counted and progress.total > 0
        meter = tqdm.format_meter(
            progress.done,
            progress.total or None,
            now - (pace.began if timed else start),
            prefix=progress.what,
            bar_format=_format_of(progress),
            initial=first if timed else 0,
        )
        sys.stderr.write(f"{meter}\n")
        sys.stderr.flush()

    return report


def _format_of(progress: Progress) -> str | None:
    """Return how progress is shown: with the time left, which is tqdm's default, only where the work is counted."""
    if progress.total == 0:
        return ELAPSED_FORMAT
    return None if progress.counted else STAGES_FORMAT


def _end(status: int, message: str = "") -> NoReturn:
    if message:
        sys.stderr.write(f"{message}\n")
    sys.stdout.flush()
    sys.stderr.flush()
    sys.exit(status)
