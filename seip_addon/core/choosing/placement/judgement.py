"""Judgement of finalists: what a detector finds with several placements in the same frames of traffic."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...counts import counted
from ...estimates import Interval

MEAN = "mean"
"""Name of the weighted mean over the classes of road users."""


@dataclass(frozen=True)
class Figure:
    """Average precision, or a difference of two.

    Parameters
    ----------
    value : float, 0 to 1
    interval : (float, float) or None
        95 % interval over runs of traffic; None if there are too few.
    """

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
    """A finalist in the frames by which the winner was chosen.

    Parameters
    ----------
    name : str
        The criterion of which it is best, or the finalist that it is near.
    sensors : tuple of str
        Positions and heights.
    poses : tuple of int
        Rows of the visibility grid.
    frames : int
        Frames until it was behind, or all.
    precision : mapping of str to Figure
        Average precision by class of road users, and `MEAN`, in these frames.
    """

    name: str
    sensors: tuple[str, ...]
    poses: tuple[int, ...]
    frames: int
    precision: Mapping[str, Figure]


@dataclass(frozen=True)
class FinalFigures:
    """A finalist in runs that chose nothing.

    Parameters
    ----------
    finalist : int
        Its number in `Judgement.finalists`.
    precision : mapping of str to Figure
        Average precision by class of road users, and `MEAN`.
    behind : Figure or None
        By how much the mean of the winner exceeds its mean; None for the winner.
    """

    finalist: int
    precision: Mapping[str, Figure]
    behind: Figure | None = None


@dataclass(frozen=True)
class Judgement:
    """Finalists with what a detector finds with them; the first of `figures` is the winner.

    Parameters
    ----------
    finalists : tuple of JudgedFinalist
        The first is the best by the criterion of the placement.
    weights : mapping of str to float
        Weight of each class of road users in the mean.
    judged_on, figures_on : tuple of str
        Runs by which the winner was chosen, and those of its figures.
    figures : tuple of FinalFigures
        Those of the winner, of the runner-up, and of the best by the criterion, each once.
    """

    finalists: tuple[JudgedFinalist, ...]
    weights: Mapping[str, float]
    judged_on: tuple[str, ...]
    figures_on: tuple[str, ...]
    figures: tuple[FinalFigures, ...]

    def __post_init__(self) -> None:
        if not self.figures or not all(one.finalist in range(len(self.finalists)) for one in self.figures):
            raise ValueError("the figures are not of finalists")
        if not all(MEAN in one.precision for one in (*self.finalists, *self.figures)):
            raise ValueError(f"average_precision.{MEAN} is missing")

    @property
    def winner(self) -> JudgedFinalist:
        """The finalist with the largest mean average precision."""
        return self.finalists[self.figures[0].finalist]

    def sentences(self) -> tuple[str, ...]:
        """Return how the winner was chosen, its average precision, and its lead, as sentences."""
        winner, first = self.figures[0], self.finalists[0]
        weights = list(self.weights.values())
        shares = f" weighted {' : '.join(f'{one:g}' for one in weights)}" if len(set(weights)) > 1 else ""
        classes = ", ".join(f"{name} {one.describe()}" for name, one in winner.precision.items() if name != MEAN)
        chosen = (
            f"Chosen by detection among {counted(len(self.finalists), 'finalist')} ({self.winner.name}): largest mean "
            f"AP of {', '.join(self.weights)}{shares} in {counted(self.winner.frames, 'frame')} of "
            f"{counted(len(self.judged_on), 'run')}."
        )
        mean = winner.precision[MEAN].describe()
        lines = [chosen, f"AP in {counted(len(self.figures_on), 'other run')}: {classes}; mean {mean}."]
        for one in self.figures[1:]:
            name = self.finalists[one.finalist].name
            other = f"the best by the criterion, {name}" if one.finalist == 0 else f"the runner-up, {name}"
            lead = "" if one.behind is None else one.behind.describe_lead()
            lines.append(f"Mean AP compared with {other}: {lead}.")
        if winner.finalist == 0:
            lines.append(f"It is the best by the criterion, {first.name}, too.")
        return tuple(lines)
