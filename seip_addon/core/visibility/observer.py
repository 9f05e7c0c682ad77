"""The visibility task in chunks that run in any order, on any machine."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import Boolean, Float, Integer
from ..lidar import LidarModel
from ..progress import PAUSE, Progress
from ..site.site import Site
from .near_surfaces import near_surfaces
from .ray_casting import RayCaster
from .sight import Sight

_PLACES_IN_A_PIECE = 16  # a second's work or less


@dataclass(frozen=True, eq=False)
class Rows:
    """What some poses see.

    Parameters
    ----------
    packed : (k, ceil(t / 8)) uint8
        Bits of V, as `numpy.packbits` packs them.
    rays : int
        How many rays were cast for it.
    """

    packed: NDArray[np.uint8]
    rays: int


class Observer:
    """Looks from the poses of a site. What is the same for all poses is computed once.

    Parameters
    ----------
    models : mapping of str to LidarModel
        At least those that the candidates name.
    delta : float, metres
    caster : RayCaster
        Of the site's triangles.
    """

    def __init__(
        self, site: Site, models: Mapping[str, LidarModel], delta: float, min_intensity: float, caster: RayCaster
    ) -> None:
        self._poses, self._models = site.candidates, models
        surfaces = near_surfaces(site.triangles, site.targets.xyz, delta)
        self._sight = Sight(caster, surfaces, delta, min_intensity)

    @property
    def targets(self) -> int:
        """Number of targets."""
        return len(self._sight.surfaces.xyz)

    def see(self, poses: Integer) -> Rows:
        """Find what poses see; those at one place, of different sensors, share rays.

        Parameters
        ----------
        poses : (k,) int64
        """
        packed = np.zeros((len(poses), (self.targets + 7) // 8), dtype=np.uint8)
        rays = 0
        for members in places(self._poses.xyz[poses], self._poses.yaw[poses], self._poses.tilt[poses]):
            here = poses[members]
            models = [self._models[key] for key in self._poses.sensor[here].tolist()]
            seen, cast = self._look(int(here[0]), models)
            packed[members] = np.packbits(seen, axis=1)
            rays += cast
        return Rows(packed, rays)

    def _look(self, pose: int, models: Sequence[LidarModel]) -> tuple[Boolean, int]:
        poses = self._poses
        if poses.tilt[pose] == 0:
            return self._sight.level(models, poses.xyz[pose], float(poses.yaw[pose]))
        return self._sight.turned(models, poses.xyz[pose], poses.orientation(pose))


def places(xyz: Float, yaw: Float, tilt: Float) -> list[Integer]:
    """Group poses that have position, yaw and tilt in common: their sensors can share rays.

    Parameters
    ----------
    xyz : (c, 3) float64, metres
    yaw, tilt : (c,) float64, radians

    Returns
    -------
    list of (k,) int64
        In the order of their first poses.
    """
    _, first, place = np.unique(np.column_stack([xyz, yaw, tilt]), axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))[place.ravel()]
    order = np.argsort(rank, kind="stable")
    return np.split(order, np.cumsum(np.bincount(rank))[:-1])


def pieces_of(site: Site) -> list[Integer]:
    """Divide the poses of a site into pieces of work, places kept whole."""
    whole = places(site.candidates.xyz, site.candidates.yaw, site.candidates.tilt)
    groups = range(0, len(whole), _PLACES_IN_A_PIECE)
    return [np.concatenate(whole[begin : begin + _PLACES_IN_A_PIECE]) for begin in groups]


class KeptPieces(Protocol):
    """Where finished pieces outlive an interruption."""

    def load(self, number: int) -> Rows | None:
        """Return a piece that was kept, or None."""

    def save(self, number: int, rows: Rows) -> None:
        """Keep a piece."""


def see_pieces(
    pieces: Sequence[Integer], submit: Callable[[Integer], Future[Rows]], kept: KeptPieces | None = None
) -> Generator[Progress, None, list[Rows]]:
    """Have pieces worked on, whoever does it, and collect the results.

    Parameters
    ----------
    pieces : sequence of (k,) int64
    submit : callable
        Starts the work on one piece.
    kept : KeptPieces, optional
        Pieces in it are not worked on again; those that are finished are added.

    Returns
    -------
    list of Rows
        One for each piece.
    """
    loaded = {number: kept.load(number) for number in range(len(pieces))} if kept else {}
    rows = {number: found for number, found in loaded.items() if found and len(found.packed) == len(pieces[number])}
    total = sum(map(len, pieces))
    done = sum(len(pieces[number]) for number in rows)
    yield Progress(done, total, "visibility")
    numbers = {submit(piece): number for number, piece in enumerate(pieces) if number not in rows}
    pending = set(numbers)
    try:
        while pending:
            finished, pending = wait(pending, PAUSE, FIRST_COMPLETED)  # so that whoever steps this can stop it soon
            for future in finished:
                number = numbers[future]
                rows[number] = future.result()
                if kept:
                    kept.save(number, rows[number])
                done += len(pieces[number])
            yield Progress(done, total, "visibility")
    finally:
        for future in pending:
            future.cancel()
    return [rows[number] for number in range(len(pieces))]
