"""Judgement of finalists: what a detector finds with several placements in the same frames of traffic."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...base.counts import counted
from ...base.estimates import Interval

DEFAULT_FINALISTS = 12
MEAN = "mean"
"""Name of the weighted mean over the classes of road users."""


@dataclass(frozen=True)
class Figure:
    """Average precision, or a difference of two, with its 95 % interval over runs; None if there are too few runs."""

    value: float
    interval: Interval | None = None

    def describe(self) -> str:
        """Return it in per cent."""
        return f"{self.value:.1%}" + ("" if self.interval is None else " ({:.1%} to {:.1%})".format(*self.interval))

    def describe_lead(self) -> str:
        """Return a difference in points, and whether it is beyond chance."""
        points = f"{100 * self.value:+.1f} points"
        if self.interval is None:
            return f"{points}, from too few runs to tell it from chance"
        low, high = (100 * end for end in self.interval)
        return f"{points} [{low:+.1f}, {high:+.1f}]{', no difference beyond chance' if low <= 0 <= high else ''}"


@dataclass(frozen=True)
class JudgedFinalist:
    """A placement that was judged.

    Parameters
    ----------
    name : str
        The criterion of which it is best, or the finalist that it is near.
    places : tuple of str
        Positions and heights of its sensors.
    poses : tuple of int
        Rows of the visibility grid.
    frames : int
        Frames of the choice until it was behind, or all.
    precision : mapping of str to Figure
        Average precision by class of road users, and `MEAN`, in these frames.
    final : mapping of str to Figure, optional
        The same in the runs that chose nothing, of the winner, the runner-up and the best by the criterion.
    behind : Figure, optional
        By how much the mean of the winner exceeds its mean in these runs.
    """

    name: str
    places: tuple[str, ...]
    poses: tuple[int, ...]
    frames: int
    precision: Mapping[str, Figure]
    final: Mapping[str, Figure] | None = None
    behind: Figure | None = None


@dataclass(frozen=True)
class Judgement:
    """Finalists with what a detector finds with them.

    Parameters
    ----------
    finalists : tuple of JudgedFinalist
        The winner first, then the runner-up.
    plain : int
        Number of the best by the criterion.
    weights : mapping of str to float
        Weight of each class of road users in the mean.
    judged_on, figures_on : tuple of str
        Runs by which the winner was chosen, and those of its figures.
    """

    finalists: tuple[JudgedFinalist, ...]
    plain: int
    weights: Mapping[str, float]
    judged_on: tuple[str, ...]
    figures_on: tuple[str, ...]

    def __post_init__(self) -> None:
        known = self.plain in range(len(self.finalists)) and self.finalists[0].final is not None
        if not known or not all(MEAN in (one.final or one.precision) for one in self.finalists):
            raise ValueError("the figures of the finalists are incomplete")

    def sentences(self) -> tuple[str, ...]:
        """Return how the winner was chosen, its average precision, and its lead, as sentences."""
        winner, weights = self.finalists[0], list(self.weights.values())
        shares = f" weighted {' : '.join(f'{one:g}' for one in weights)}" if len(set(weights)) > 1 else ""
        chosen = (
            f"Chosen by detection among {counted(len(self.finalists), 'finalist')} ({winner.name}): largest mean AP of "
            f"{', '.join(self.weights)}{shares} in {counted(winner.frames, 'frame')} of "
            f"{counted(len(self.judged_on), 'run')}."
        )
        found = ", ".join(f"{name} {one.describe()}" for name, one in (winner.final or {}).items())
        lines = [chosen, f"AP in {counted(len(self.figures_on), 'other run')}: {found}."]
        for number, one in enumerate(self.finalists):
            if one.behind is not None:
                other = "best by the criterion" if number == self.plain else "runner-up"
                lines.append(f"Mean AP compared with the {other}, {one.name}: {one.behind.describe_lead()}.")
        return (*lines, *(["It is the best by the criterion, too."] if self.plain == 0 else []))
