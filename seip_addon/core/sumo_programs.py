"""Programs of SUMO (Simulation of Urban MObility, Eclipse), which is an optional extra: found and run."""

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
"""Where systems keep SUMO's data."""


@dataclass(frozen=True)
class Sumo:
    """SUMO's programs, and the folder that holds their ``data``, where that is known."""

    sumo: Path
    netconvert: Path
    home: Path | None


def find_sumo() -> Sumo:
    """Find SUMO's programs: on the PATH, in ``SUMO_HOME``, or in the package ``eclipse-sumo`` of this Python.

    Raises
    ------
    SeipError
        They are not installed.
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
    """Run one of SUMO's programs to its end.

    Parameters
    ----------
    program : Path
        Of ``programs``.
    what : str
        What it does, for the person who waits.

    Raises
    ------
    SeipError
        It fails.
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
    finally:  # also where nobody waits for it any more
        process.kill()
        process.wait()
    if process.returncode != 0:
        raise SeipError(f"{program.name} failed: {_last_error(complaint)}; check the map, or simulate in SUMO itself")


def _last_error(complaint: str) -> str:
    lines = [line.removeprefix("Error:").strip() for line in complaint.splitlines() if line.startswith("Error:")]
    return lines[0].rstrip(".") if lines else "it says no reason"
