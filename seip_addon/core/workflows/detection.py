"""Detection for programs without PyTorch: ``seip detect`` runs as a command in a Python that has it."""

import os
import re
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..base.errors import SeipError
from ..base.progress import Progress
from ..output.results.detection_record import FORMATS, parsed_detection
from ..programs.child_process import run_logged
from ..sensing.weather import Weather

RECORD, ERRORS = "detection.json", "errors.png"
"""Files of the result: its figures, and the picture of correct, missed and false detections."""
INSTALL = (
    "download this project's source as a .zip and run `pip install 'FILE.zip[detection]'`, or `make detection` in a "
    "checkout"
)
"""Instructions to install PyTorch and this project."""

_LINE = re.compile(r"^(.+): (?:(\d+)% done, )?(?:.+, )?[\d.]+ (?:s|min|h) (left|elapsed)$", re.MULTILINE)
_ERROR = re.compile(r"^(?:[\w-]+: )?error: (.+)$", re.MULTILINE)
_SECONDS_BETWEEN_LINES = "1"


@dataclass(frozen=True)
class DetectingPython:
    """A Python with PyTorch and this project.

    Parameters
    ----------
    program : path
        Path of the interpreter.
    folder : path
        Working folder: a checkout there is used if the project is not installed.
    """

    program: Path
    folder: Path


@dataclass(frozen=True)
class DetectionJob:
    """Inputs of a detection.

    Parameters
    ----------
    python : DetectingPython
        Python to run it with.
    runs : tuple of path
        Runs of traffic.
    detector : path or None
        Trained detector; None for the shipped one.
    catalogue : tuple of path
        The user's own catalogues of LiDARs.
    weather : Weather
        Weather for the sensors.
    """

    python: DetectingPython
    runs: tuple[Path, ...]
    detector: Path | None = None
    catalogue: tuple[Path, ...] = ()
    weather: Weather = Weather()

    def command(self, scene: Path, output: Path) -> list[str]:
        """Return the command for a .blend with sensors and a folder of results."""
        words = [self.python.program, "-m", "headless", "detect", scene, "-o", output, *self.options()]
        return [os.fspath(word) for word in words]

    def options(self) -> list[str | Path]:
        """Return the options that name the runs, the detector, catalogues and the weather."""
        words: list[str | Path] = ["--traffic", *self.runs]
        for option, values in (
            ("--detector", (self.detector,) if self.detector is not None else ()),
            ("--catalogue", self.catalogue),
            ("--weather", self.weather.words()),
        ):
            words += [option, *values] if values else []
        return words


def detect_elsewhere(job: DetectionJob, scene: Path, folder: Path) -> Generator[Progress, None, str]:
    """Detect road users with the sensors of a scene, and write the result to a folder, replacing an earlier one.

    Parameters
    ----------
    scene : path
        A .blend in a folder for temporary files, on the file system of ``folder``.
    folder : path
        Existing folder for the result.

    Yields
    ------
    Progress
        Progress in frames. Closing the generator ends the command; the earlier result is then kept.

    Returns
    -------
    str
        Text of ``detection.json``.

    Raises
    ------
    SeipError
        The command fails, or its result cannot be read or written.
    """
    results, log = scene.parent / "results", scene.parent / "log"
    yield from run_elsewhere(job.python, job.command(scene, results), log)
    try:
        text = (results / RECORD).read_text(encoding="utf-8")
        parsed_detection(text)
        _put_in_place(results, folder)
    except OSError as error:
        reason = error.strerror or str(error)
        raise SeipError(f"cannot write to {folder}: {reason}; choose a folder that you may write to") from error
    return text


def run_elsewhere(python: DetectingPython, command: Sequence[str | Path], log: Path) -> Generator[Progress, None, None]:
    """Run a command of this project in a Python with PyTorch, with its output in a file.

    Raises
    ------
    SeipError
        It cannot be started, or fails; with its own reason.
    """
    words = [os.fspath(word) for word in command]
    variables = {"PYTHONUTF8": "1", "SEIP_SECONDS_BETWEEN_LINES": _SECONDS_BETWEEN_LINES}
    try:
        status = yield from run_logged(words, log, _progress, folder=python.folder, environment=variables)
    except OSError as error:
        raise SeipError(
            f"{python.program} cannot be started ({error.strerror}): name the Python with PyTorch in the "
            "preferences of the extension"
        ) from error
    if status != 0:
        raise SeipError(_failure(log.read_text(encoding="utf-8", errors="replace"), status, python.program))


def _progress(output: str) -> Progress:
    """Return the progress in the last `progress_line` of the command's output."""
    lines = _LINE.findall(output)
    if not lines:
        return Progress(0, 0, "starting PyTorch")
    what, percent, time = lines[-1]
    return Progress(int(percent or 0), 100 if percent else 0, what, counted=time == "left")


def _failure(output: str, status: int, program: Path) -> str:
    """Return the reason why the command failed: its error message, or its last line of output."""
    own = _ERROR.findall(output)
    if own:
        return str(own[-1])
    if "No module named headless" in output:
        return f"{program} does not have this project: {INSTALL}"
    last = output.strip().splitlines()[-1:]
    return f"detection failed in {program}: {' '.join(last) or f'it ended with status {status}'}"


def _put_in_place(results: Path, folder: Path) -> None:
    """Move a result to its folder, its record last; all frames of an earlier result are removed."""
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
