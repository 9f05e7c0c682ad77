"""Time that road users spend on each target's square."""

from collections.abc import Generator, Sequence

import numpy as np

from ...arrays import Float, Integer
from ...errors import SeipError
from ...progress import Progress
from ...sensing.traffic.trajectories import WARM_UP, Trajectories
from ...site.targets import Targets

INTERVAL = 0.2  # seconds between samples: a car at 50 km/h moves 2.8 m, less than its length

_ALONG, _ACROSS = 12, 4
"""Numbers of evenly spread points of a footprint, all with the same share: whole numbers keep weights commensurable."""

_SHARES = np.stack(
    np.meshgrid((np.arange(_ALONG) + 0.5) / _ALONG - 0.5, (np.arange(_ACROSS) + 0.5) / _ACROSS - 0.5), axis=-1
).reshape(-1, 2)


def road_user_seconds(targets: Targets, runs: Sequence[Trajectories]) -> Generator[Progress, None, Float]:
    """Compute the time that road users spend over each target; each road user has the same weight whatever its size.

    Parameters
    ----------
    runs : sequence of Trajectories
        Trajectories in the scene's local axes; the first `WARM_UP` seconds of each are left out.

    Yields
    ------
    Progress
        Progress after each run.

    Returns
    -------
    (t,) float64, seconds
        Time over each target. If half of a footprint is in a target's square, half of the time counts: the sum is the
        time that all road users together spend over targets.

    Raises
    ------
    SeipError
        No road user is ever over a target.
    """
    square = _Squares(targets)
    parts = np.zeros(len(targets), dtype=np.int64)
    for number, run in enumerate(runs):
        yield Progress(number, len(runs), "adding up the time of road users")
        size = np.array([(user.length, user.width) for user in run.users])
        begin, end = run.span[0] + WARM_UP, run.span[1]
        for time in (begin + INTERVAL * (np.arange(max(round((end - begin) / INTERVAL), 0)) + 0.5)).tolist():
            now = run.at(time)
            ahead = np.column_stack([np.cos(now.yaw), np.sin(now.yaw)])
            left = np.column_stack([-np.sin(now.yaw), np.cos(now.yaw)])
            inside = size[now.user][:, None] * _SHARES
            places = now.position[:, None, :2] + inside[..., :1] * ahead[:, None] + inside[..., 1:] * left[:, None]
            target = square.of(places.reshape(-1, 2))
            parts += np.bincount(target[target >= 0], minlength=len(targets))
    if not parts.any():
        raise SeipError("no road user is ever over a target: use traffic of this site, or a longer run")
    yield Progress(len(runs), len(runs), "adding up the time of road users")
    return parts * (INTERVAL / len(_SHARES))


class _Squares:
    """Index of the squares of the targets' grid, to look up points."""

    def __init__(self, targets: Targets) -> None:
        self._side = targets.spacing
        self._low = targets.xyz[:, :2].min(axis=0) - self._side / 2
        column, row = self._cells(targets.xyz[:, :2])
        self._target = np.full((column.max() + 1, row.max() + 1), -1, dtype=np.int64)
        self._target[column, row] = np.arange(len(targets))

    def of(self, places: Float) -> Integer:
        """Return the target of the square that contains each point (n, 2), (n,); -1 for none."""
        column, row = self._cells(places)
        most = self._target.shape
        inside = (column >= 0) & (column < most[0]) & (row >= 0) & (row < most[1])
        found = np.full(len(places), -1, dtype=np.int64)
        found[inside] = self._target[column[inside], row[inside]]
        return found

    def _cells(self, places: Float) -> tuple[Integer, Integer]:
        column, row = np.floor((places - self._low) / self._side).astype(np.int64).T
        return column, row
