"""Search for and execution of the programs of SUMO (Eclipse Simulation of Urban MObility), an optional extra."""

import importlib.util
import os
import shutil
import subprocess
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .errors import SeipError
from .progress import Progress, in_thread

MISSING = (
    "SUMO is not installed, which lays out streets and simulates traffic: install Eclipse SUMO and put sumo and "
    "netconvert on the PATH or set SUMO_HOME (in a checkout `make sumo`, with pip `pip install --group traffic`)"
)
SYSTEM_HOMES = (Path("/usr/share/sumo"), Path("/usr/local/share/sumo"), Path("/opt/homebrew/share/sumo"))
"""System folders for the data of SUMO."""


@dataclass(frozen=True)
class Sumo:
    """Programs of SUMO, and the folder that contains their ``data``, None if it was not found."""

    sumo: Path
    netconvert: Path
    home: Path | None


def find_sumo() -> Sumo:
    """Find the programs of SUMO: on the PATH, in ``SUMO_HOME``, or in the package ``eclipse-sumo`` of this Python.

    Raises
    ------
    SeipError
        SUMO is not installed.
    """
    package = importlib.util.find_spec("sumo")
    homes = [Path(package.origin).parent] if package is not None and package.origin is not None else []
    homes += [Path(os.environ["SUMO_HOME"])] if os.environ.get("SUMO_HOME") else []
    where = os.pathsep.join([os.environ.get("PATH", ""), *(str(home / "bin") for home in homes)])
    sumo, netconvert = shutil.which("sumo", path=where), shutil.which("netconvert", path=where)
    if sumo is None or netconvert is None:
        raise SeipError(MISSING)
    homes += [Path(netconvert).resolve().parents[1], *SYSTEM_HOMES]
    return Sumo(Path(sumo), Path(netconvert), next((home for home in homes if (home / "data").is_dir()), None))


def run(programs: Sumo, program: Path, arguments: Sequence[object], what: str) -> Generator[Progress, None, None]:
    """Run a program of SUMO to its end.

    Parameters
    ----------
    program : Path
        Program to run, one of ``programs``.
    arguments : sequence of object
        Arguments of the program.
    what : str
        Description of the work for the user.

    Raises
    ------
    SeipError
        The program fails.
    """
    environment = os.environ | ({} if programs.home is None else {"SUMO_HOME": str(programs.home)})

    process = subprocess.Popen(  # noqa: S603  # SUMO's program, found by its name, and our arguments
        [str(part) for part in (program, *arguments)],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        _, complaint = yield from in_thread(lambda _stop: process.communicate(), what)
    finally:  # also if the generator is closed early
        process.kill()
        process.wait()
    if process.returncode != 0:
        raise SeipError(f"{program.name} failed: {_last_error(complaint)}; check the map, or simulate in SUMO itself")


def _last_error(complaint: str) -> str:
    lines = [line.removeprefix("Error:").strip() for line in complaint.splitlines() if line.startswith("Error:")]
    return lines[0].rstrip(".") if lines else "it gave no reason"
