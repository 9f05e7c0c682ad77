"""Chunks of the visibility grid, which can be computed in any order and on any machine."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.progress import REPORT_INTERVAL, Progress
from ...site.candidates import Candidates
from ...site.site import Site
from ..lidar.model import LidarModel
from .visibility_model import VisibilityModel

Result = TypeVar("Result")

_POSITIONS_IN_A_CHUNK = 16  # a second's work or less


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of the visibility grid for k candidate poses, bit-packed.

    Parameters
    ----------
    packed : (k, ceil(t / 8)) uint8
        Visibility of t targets from each pose, packed along axis 1 by `numpy.packbits`.
    rays : int
        Number of rays cast for these rows.
    """

    packed: NDArray[np.uint8]
    rays: int


def compute_rows(
    model: VisibilityModel, candidates: Candidates, models: Mapping[str, LidarModel], poses: Integer
) -> Rows:
    """Compute the visibility of all targets from some candidate poses.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, including those of all candidates.
    poses : (k,) int64
        Indices of the poses.
    """
    packed = np.zeros((len(poses), (model.targets + 7) // 8), dtype=np.uint8)
    rays = 0
    for members in sharing_rays(candidates.xyz[poses], candidates.yaw[poses], candidates.tilt[poses]):
        first = poses[members[0]]
        types = [models[key] for key in candidates.sensor[poses[members]].tolist()]
        if candidates.tilt[first] == 0:
            seen, cast = model.see_upright(types, candidates.xyz[first], float(candidates.yaw[first]))
        else:
            seen, cast = model.see_all(types, candidates.xyz[first], candidates.orientation(int(first)))
        packed[members] = np.packbits(seen, axis=1)
        rays += cast
    return Rows(packed, rays)


def sharing_rays(xyz: Float, yaw: Float, tilt: Float) -> list[Integer]:
    """Group poses that have position, yaw and tilt in common: their sensors can share rays.

    Parameters
    ----------
    xyz : (c, 3) float64, metres
    yaw, tilt : (c,) float64, radians

    Returns
    -------
    list of (k,) int64
        Indices of the poses of each group, in the order of their first poses.
    """
    _, first, group = np.unique(np.column_stack([xyz, yaw, tilt]), axis=0, return_index=True, return_inverse=True)
    # np.unique numbers the groups by their coordinates; the rank of a group's first pose renumbers them in the order of
    # the candidates. A stable sort by group then keeps that order within each group.
    rank = np.argsort(np.argsort(first))[group.ravel()]
    order = np.argsort(rank, kind="stable")
    return np.split(order, np.cumsum(np.bincount(rank))[:-1])


def chunks_of(site: Site) -> list[Integer]:
    """Divide the poses of a site into chunks of work; poses that share rays stay together."""
    groups = sharing_rays(site.candidates.xyz, site.candidates.yaw, site.candidates.tilt)
    begins = range(0, len(groups), _POSITIONS_IN_A_CHUNK)
    return [np.concatenate(groups[begin : begin + _POSITIONS_IN_A_CHUNK]) for begin in begins]


class Checkpoint(Protocol):
    """Storage that keeps finished chunks after an interruption."""

    def load(self, number: int) -> Rows | None:
        """Return a stored chunk, or None."""

    def save(self, number: int, rows: Rows) -> None:
        """Store a chunk."""


def compute_chunks(
    chunks: Sequence[Integer], submit: Callable[[Integer], Future[Rows]], checkpoint: Checkpoint | None = None
) -> Generator[Progress, None, list[Rows]]:
    """Compute chunks with an executor and collect the results.

    Parameters
    ----------
    chunks : sequence of (k,) int64
        Candidate poses.
    submit : callable
        Function that starts the work on one chunk.
    checkpoint : Checkpoint, optional
        Storage of finished chunks. Chunks in it are not computed again; new ones are added.

    Returns
    -------
    list of Rows
        Rows of each chunk.
    """
    loaded = {number: checkpoint.load(number) for number in range(len(chunks))} if checkpoint else {}
    rows = {number: chunk for number, chunk in loaded.items() if chunk and len(chunk.packed) == len(chunks[number])}
    keep = checkpoint.save if checkpoint else None
    yield from collect(chunks, submit, rows, "visibility", keep)
    return [rows[number] for number in range(len(chunks))]


def collect(
    chunks: Sequence[Integer],
    submit: Callable[[Integer], Future[Result]],
    results: dict[int, Result],
    work: str,
    keep: Callable[[int, Result], None] | None = None,
) -> Generator[Progress, None, None]:
    """Compute the chunks that have no result yet and add their results.

    Closing the generator cancels chunks that have not started.

    Parameters
    ----------
    chunks : sequence of (k,) int64
        Candidate poses.
    submit : callable
        Function that starts the work on one chunk.
    results : dict of int to result
        Results by the number of the chunk; those of this call are added.
    work : str
        Name of the work in progress messages.
    keep : callable, optional
        Function that is called with the number and the result of each chunk as soon as it is finished.
    """
    total = sum(map(len, chunks))
    done = sum(len(chunks[number]) for number in results)
    yield Progress(done, total, work)
    numbers = {submit(chunk): number for number, chunk in enumerate(chunks) if number not in results}
    pending = set(numbers)
    try:
        while pending:
            finished, pending = wait(pending, REPORT_INTERVAL, FIRST_COMPLETED)  # so that the caller can cancel soon
            for future in finished:
                number = numbers[future]
                results[number] = future.result()
                if keep:
                    keep(number, results[number])
                done += len(chunks[number])
            yield Progress(done, total, work)
    finally:
        for future in pending:
            future.cancel()
