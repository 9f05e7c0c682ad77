"""Search for and execution of the programs of SUMO (Eclipse Simulation of Urban MObility), an optional extra.

Its use is shown in `tests/core/programs/test_sumo_installation.py`.
"""

import importlib.util
import os
import re
import shutil
import subprocess
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..base.errors import SeipError
from ..base.progress import Progress
from .child_process import run_logged

MISSING = (
    "SUMO is not installed, which lays out streets and simulates traffic: install Eclipse SUMO and put sumo and "
    "netconvert on the PATH or set SUMO_HOME (in a checkout `make sumo`, with pip `pip install --group traffic`)"
)
SYSTEM_HOMES = (Path("/usr/share/sumo"), Path("/usr/local/share/sumo"), Path("/opt/homebrew/share/sumo"))
"""System folders for the data of SUMO."""
NETWORK_SUFFIX = ".net.xml"
"""End of the name of a network of SUMO, as the streets of an extract have it."""
START_SECONDS = 30.0
"""Longest time in which SUMO states its version, also while Windows checks a new program."""
_VERSION = re.compile(r"netconvert\s+(?:Version\s+)?v?(\d\S*)")


@dataclass(frozen=True)
class Sumo:
    """Programs of SUMO, and the folder that contains their ``data``, None if it was not found."""

    sumo: Path
    netconvert: Path
    home: Path | None


def find_sumo(folders: Iterable[Path] = ()) -> Sumo:
    """Find the programs of SUMO: in given folders, on the PATH, in ``SUMO_HOME``, or in this Python's ``eclipse-sumo``.

    Parameters
    ----------
    folders : iterable of Path
        Folders to search first. Each is SUMO's own folder, the ``bin`` in it, or a folder that pip installed
        ``eclipse-sumo`` into.

    Raises
    ------
    SeipError
        SUMO is not installed.
    """
    # pip writes scripts of the same names to `bin`, which only run in its Python: the programs themselves come first
    named = [place for folder in folders for place in (folder / "sumo" / "bin", folder / "bin", folder)]
    package = importlib.util.find_spec("sumo")
    homes = [Path(package.origin).parent] if package is not None and package.origin is not None else []
    homes += [Path(os.environ["SUMO_HOME"])] if os.environ.get("SUMO_HOME") else []
    places = [*map(str, named), os.environ.get("PATH", ""), *(str(home / "bin") for home in homes)]
    sumo, netconvert = _program("sumo", places), _program("netconvert", places)
    if sumo is None or netconvert is None:
        raise SeipError(MISSING)
    homes = [netconvert.resolve().parents[1], *homes, *SYSTEM_HOMES]
    return Sumo(sumo, netconvert, next((home for home in homes if (home / "data").is_dir()), None))


def _program(name: str, places: Iterable[str]) -> Path | None:
    """Return the program of a name in the first of some places that has it, each a folder or several as on the PATH."""
    return next((Path(found) for place in places if (found := shutil.which(name, path=place))), None)


def sumo_version(programs: Sumo) -> str:
    """Return the version of SUMO, such as 1.28.0, by starting netconvert.

    Raises
    ------
    SeipError
        It does not start.
    """
    try:
        done = subprocess.run(  # noqa: S603  # SUMO's program, found by its name
            [programs.netconvert, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=START_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise _not_starting(programs, str(error)) from error
    version = _VERSION.search(done.stdout.decode(errors="replace"))
    if done.returncode != 0 or version is None:
        raise _not_starting(programs, done.stderr.decode(errors="replace"))
    return version[1]


def _not_starting(programs: Sumo, complaint: str) -> SeipError:
    reason = next((f" ({line.strip()})" for line in complaint.splitlines() if line.strip()), "")
    return SeipError(f"SUMO does not start from {programs.netconvert.parent}{reason}: install it again")


def run(
    programs: Sumo, program: Path, arguments: Sequence[object], what: str, folder: Path
) -> Generator[Progress, None, None]:
    """Run a program of SUMO to its end.

    It takes commas and colons in a path for separators: the paths of files are given by their names in a folder.

    Parameters
    ----------
    program : Path
        Program to run, one of ``programs``.
    arguments : sequence of object
        Arguments of the program; paths are those of files in the folder.
    what : str
        Description of the work for the user.
    folder : Path
        Working folder of the program.

    Raises
    ------
    SeipError
        The program fails.
    """
    log, environment = (
        folder / f"{program.stem}.log",
        {} if programs.home is None else {"SUMO_HOME": str(programs.home)},
    )
    command = [str(program.absolute()), *(part.name if isinstance(part, Path) else str(part) for part in arguments)]
    steps = run_logged(command, log, lambda _: Progress(0, 0, what), folder=folder, environment=environment)
    try:
        status = yield from steps
        complaint = log.read_text(encoding="utf-8", errors="replace")
    finally:
        log.unlink(missing_ok=True)
    if status != 0:
        raise SeipError(f"{program.name} failed: {_last_error(complaint)}; check the map, or simulate in SUMO itself")


def _last_error(complaint: str) -> str:
    """Return the first error that a program reports; without one its last line, as of a library that is missing."""
    said = [line.strip() for line in complaint.splitlines() if line.strip()]
    errors = [line.removeprefix("Error:").strip() for line in said if line.startswith("Error:")]
    return next(iter(errors or said[-1:]), "it gave no reason").rstrip(".")
