"""Tasks of a network on the workers of a Dask cluster: surveys, searches, and the files of a site."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.network.frontier import SolvedBudget
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.network_sites import NetworkPlace
from seip_addon.core.workflows.survey_settings import SurveySettings

FORMAT = "seip-network-site/1"
REQUEST = "request.pickle"
SURVEY_FILES = ("site.blend", "visibility.npz", "visibility.returns.npz", "problem.npz", "site.net.xml")
"""Files of the survey of a site; the last two need not exist in all of them."""
PLACED_FILES = "placed"
"""Folder of the files of a placement, below that of the request."""
DONE = "the request is done"
"""Line that the process of sites writes after each request."""
MEMORY = 4 << 30
"""Bytes that the process of sites may use: ten times what a typical site needs."""
IN_FLIGHT = 3  # tasks for each worker that are submitted and not finished: enough to keep it busy

Client = Any
"""`distributed.Client`, which has no types."""
Files = dict[str, bytes]
"""Content of files by their names."""


@dataclass(frozen=True)
class SurveyJob:
    """A site to build and survey.

    Parameters
    ----------
    key : str
        Digest of everything that the result depends on.
    suffix, content : str and bytes
        Suffix and content of the file that the site is built from.
    """

    key: str
    place: NetworkPlace
    suffix: str
    content: bytes
    approaches: float
    settings: SurveySettings
    objective: Objective

    @property
    def file(self) -> str:
        """Name of the file that the site is built from."""
        return f"{self.place.source.name.split('.')[0]}{self.suffix}"


@dataclass(frozen=True)
class SolveJob:
    """A budget to solve at a site."""

    problem: bytes
    budget: float
    effort: float


@dataclass(frozen=True)
class PlaceJob:
    """A placement to write with all its files."""

    files: Files
    settings: SurveySettings
    objective: Objective
    taken: SolvedBudget


@dataclass(frozen=True)
class Failure:
    """Reason why a task failed, as a sentence for the user."""

    message: str


def survey_version() -> str:
    """Return a digest of the code that surveys a site."""
    return source_digest("headless")


def survey_site(job: SurveyJob) -> Files | Failure:
    """Build and survey a site in a process of its own, whose memory is limited."""
    return _in_process(job, {job.file: job.content}, SURVEY_FILES)


def write_placement(job: PlaceJob) -> Files | Failure:
    """Return the files of a placement, made in a process of its own."""
    return _in_process(job, job.files, None)


def solve_budget(job: SolveJob) -> SolvedBudget | Failure:
    """Return the best placement within a budget."""
    with tempfile.TemporaryDirectory(prefix="seip-") as folder:
        path = Path(folder) / SURVEY_FILES[3]
        path.write_bytes(job.problem)
        problem, _ = SiteProblem.load(path)
    try:
        return finish(problem.solve(job.budget, job.effort))
    except SeipError as error:
        return Failure(str(error))


def _in_process(job: SurveyJob | PlaceJob, files: Files, wanted: Sequence[str] | None) -> Files | Failure:
    """Run `headless.network_site` on a job; return the wanted files, or those of the placement."""
    with tempfile.TemporaryDirectory(prefix="seip-") as name:
        folder = Path(name)
        for file, content in files.items():
            (folder / file).write_bytes(content)
        (folder / REQUEST).write_bytes(pickle.dumps(job))
        process = _idle.pop() if _idle else _SiteProcess()
        if reason := process.run(name):
            return Failure(reason.replace(f"{name}{os.sep}", ""))
        _idle.append(process)
        if wanted is None:
            return {path.name: path.read_bytes() for path in sorted((folder / PLACED_FILES).iterdir())}
        return {file: (folder / file).read_bytes() for file in wanted if (folder / file).exists()}


class _SiteProcess:
    """A process of `headless.network_site`, which does one request after the other, and ends when one fails."""

    def __init__(self) -> None:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 -- open as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-m", "headless.network_site"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            cwd=Path(__file__).resolve().parents[1],
        )

    def run(self, folder: str) -> str:
        """Do the request in a folder; return why that failed, or ""."""
        requests, lines = self._process.stdin, self._process.stdout
        assert requests is not None and lines is not None  # noqa: S101, PT018 -- both are pipes
        try:
            requests.write(f"{folder}\n".encode())
            requests.flush()
        except BrokenPipeError:  # it has ended before
            pass
        for line in lines:
            if line.strip() == DONE.encode():
                return ""
        status = self._process.wait()
        self._errors.seek(0)
        reason = _reason(self._errors.read().decode(errors="replace"), status)
        self.close()
        return reason

    def close(self) -> None:
        """Let the process end."""
        self._process.communicate()
        self._errors.close()


_idle: list[_SiteProcess] = []
"""Processes of this worker without a request."""


def end_site_processes() -> None:
    """End the processes of this worker that have no request, which returns their memory."""
    while _idle:
        _idle.pop().close()


def _reason(text: str, status: int) -> str:
    """Return why a process failed, from what it wrote."""
    lines = [line for line in text.strip().splitlines() if line.strip()]
    if lines and lines[-1].startswith("error: "):
        return lines[-1].removeprefix("error: ")
    if status < 0:
        return f"its process was ended by signal {-status}, as when memory runs out: use fewer --workers"
    return f"its process failed: {lines[-1] if lines else f'status {status}'}"


def run_jobs(
    client: Client, function: Callable[[Any], Any], jobs: Sequence[Callable[[], Any]]
) -> Iterator[tuple[int, Any]]:
    """Run a function on jobs on the workers of a cluster; yield the number of each job with its result as they finish.

    Only a few jobs for each worker are made and submitted at a time, so that many jobs need no more memory.

    Parameters
    ----------
    client : distributed.Client
        Client of the scheduler, from `connected`.
    jobs : sequence of callable
        Each returns a job.

    Raises
    ------
    SeipError
        Several workers died on one job, or the scheduler is gone.
    """
    from distributed import CancelledError, KilledWorker, as_completed  # noqa: PLC0415 -- an extra

    waiting = iter(range(len(jobs)))
    numbers: dict[str, int] = {}
    flying = as_completed(loop=client.loop)

    def submit(number: int) -> None:
        future = client.submit(function, jobs[number](), pure=False)
        numbers[future.key] = number
        flying.add(future)

    threads = sum(client.nthreads().values())
    try:
        for _, number in zip(range(IN_FLIGHT * max(1, threads)), waiting, strict=False):
            submit(number)
        while numbers:
            future = next(flying)
            number = numbers.pop(future.key)
            result = future.result()
            future.release()
            following = next(waiting, None)
            if following is not None:
                submit(following)
            yield number, result
        client.run(end_site_processes)
    except KilledWorker as error:
        raise SeipError(
            f"several workers died on one task ({error}): give them more memory, and run the command again to go on"
        ) from error
    except (CancelledError, OSError) as error:
        raise SeipError("the Dask scheduler stopped: start it again, and run the same command to go on") from error
    finally:
        flying.clear()
