"""Detection as one job for programs without PyTorch: the command ``seip detect`` runs in a Python that has it."""

import os
import re
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from ..child_process import run_logged
from ..errors import SeipError
from ..output.results.detection_record import FORMATS, parsed_detection
from ..progress import Progress
from ..site.weather import Weather

RECORD, ERRORS = "detection.json", "errors.png"
"""Files of the result: its figures, and the picture of found, missed and false."""
INSTALL = "run `make detection` or `pip install '.[detection]'` in a checkout of this project"
"""How a Python gets PyTorch and this project."""

_BAR = re.compile(r"^(.+?): +\d+%\|.*\| (\d+)/(\d+) \[[\d:]+(<?)", re.MULTILINE)
_ERROR = re.compile(r"^(?:[\w-]+: )?error: (.+)$", re.MULTILINE)
_SECONDS_BETWEEN_LINES = "1"


@dataclass(frozen=True)
class DetectingPython:
    """A Python with PyTorch and this project.

    Parameters
    ----------
    program : path
        The interpreter.
    folder : path
        To run it in: a checkout is found from there, where the project is not installed.
    """

    program: Path
    folder: Path


@dataclass(frozen=True)
class DetectionJob:
    """What is detected with what.

    Parameters
    ----------
    runs : tuple of path
        Of traffic.
    detector : path or None
        None for the one that ships.
    catalogue : tuple of path
        The user's own catalogues of LiDARs.
    weather : Weather
        That the sensors look through.
    """

    python: DetectingPython
    runs: tuple[Path, ...]
    detector: Path | None = None
    catalogue: tuple[Path, ...] = ()
    weather: Weather = Weather()

    def command(self, scene: Path, output: Path) -> list[str]:
        """Return the command for a .blend with sensors and a folder of results."""
        words: list[str | Path] = [self.python.program, "-m", "headless", "detect", scene, "-o", output]
        words += ["--traffic", *self.runs]
        for option, values in (
            ("--detector", (self.detector,) if self.detector is not None else ()),
            ("--catalogue", self.catalogue),
            ("--weather", self.weather.words()),
        ):
            words += [option, *values] if values else []
        return [os.fspath(word) for word in words]


def detect_elsewhere(job: DetectionJob, scene: Path, folder: Path) -> Generator[Progress, None, str]:
    """Detect road users with the sensors of a scene, and put the result into a folder, in place of an earlier one.

    Parameters
    ----------
    scene : path
        A .blend in a folder for temporary files, on the file system of ``folder``.
    folder : path
        It is there.

    Yields
    ------
    Progress
        Of frames; the command is ended when this is closed, and the earlier result stays.

    Returns
    -------
    str
        The text of ``detection.json``.

    Raises
    ------
    SeipError
        The command refuses or fails, or its result cannot be read or written.
    """
    results, log = scene.parent / "results", scene.parent / "log"
    told = {"PYTHONUTF8": "1", "SEIP_SECONDS_BETWEEN_LINES": _SECONDS_BETWEEN_LINES}
    running = run_logged(job.command(scene, results), log, _progress, folder=job.python.folder, environment=told)
    try:
        status = yield from running
    except OSError as error:
        raise SeipError(
            f"{job.python.program} cannot be started ({error.strerror}): name the Python with PyTorch in the "
            "preferences of the extension"
        ) from error
    said = log.read_text(encoding="utf-8", errors="replace")
    if status != 0:
        raise SeipError(_complaint(said, status, job.python.program))
    try:
        text = (results / RECORD).read_text(encoding="utf-8")
        parsed_detection(text)
        _put_in_place(results, folder)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SeipError(f"cannot write to {folder}: {reason}; choose a folder that you may write to") from error
    return text


def _progress(said: str) -> Progress:
    bars = _BAR.findall(said)
    if not bars:
        return Progress(0, 0, "starting PyTorch")
    what, done, total, time_left = bars[-1]
    return Progress(int(done), int(total), what, counted=bool(time_left))


def _complaint(said: str, status: int, program: Path) -> str:
    """Return why the command failed: its own sentence, or what stands in its place."""
    own = _ERROR.findall(said)
    if own:
        return str(own[-1])
    if "No module named headless" in said:
        return f"{program} does not have this project: {INSTALL}"
    last = said.strip().splitlines()[-1:]
    return f"detection failed in {program}: {' '.join(last) or f'it ended with status {status}'}"


def _put_in_place(results: Path, folder: Path) -> None:
    """Move a result to its folder, its record last; of an earlier one's frames none stays."""
    (folder / RECORD).unlink(missing_ok=True)
    for frames in FORMATS:
        for old in (folder / frames).glob("[0-9]" * 6 + ".txt"):
            old.unlink()
    for path in sorted(results.rglob("*"), key=lambda path: path.name == RECORD):
        target = folder / path.relative_to(results)
        if path.is_dir():
            target.mkdir(exist_ok=True)
        else:
            path.replace(target)
