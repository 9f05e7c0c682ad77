"""Scenarios that a placement is optimised over: nominal poses on the empty road, pose errors, or traffic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...base.errors import SeipError
from ...base.limits import DRAWS, SCENARIOS
from ...base.settings import setting
from ...sensing.scenarios.pose_errors import PoseErrors

ScenarioKind = Literal["nominal", "pose-errors", "traffic"]

DEFAULT_COUNTS = {"pose-errors": (20, 500), "traffic": (24, 120)}
"""Number of scenarios to optimise over and of held-out ones, by kind."""


@dataclass(frozen=True)
class Scenarios:
    """Scenarios to optimise a placement over, and held-out ones to evaluate it on.

    Parameters
    ----------
    kind : {"nominal", "pose-errors", "traffic"}
        Kind of the scenarios: a single one with all poses as planned on the empty road; random pose errors; or instants
        of traffic at which vehicles block the view.
    pose_errors : PoseErrors
        Standard deviations, for pose errors only.
    count, held_out : int, optional
        Number of scenarios to optimise over and of held-out ones; `DEFAULT_COUNTS` if not given.
    seed : int
        Seed of the scenarios to optimise over; the held-out ones have the next seed.

    Raises
    ------
    SeipError
        A number is out of its limits.

    Examples
    --------
    >>> scenarios = Scenarios("pose-errors", PoseErrors(position=0.1, height=0.1))
    >>> scenarios.errs, scenarios.optimised, scenarios.evaluated
    (True, 20, 500)
    """

    kind: ScenarioKind = "nominal"
    pose_errors: PoseErrors = PoseErrors()
    count: int | None = None
    held_out: int | None = None
    seed: int = setting(0, "seed of the scenarios (held-out scenarios use seed + 1)", minimum=0)

    def __post_init__(self) -> None:
        if self.kind == "nominal":
            return
        what = "pose errors" if self.kind == "pose-errors" else "instants of traffic"
        for number, limits in ((self.optimised, SCENARIOS), (self.evaluated, DRAWS if self.errs else SCENARIOS)):
            if not limits.allow(number):
                raise SeipError(f"the number of {what} must be {limits}, not {number}")
        if self.seed < 0:
            raise SeipError(f"the seed of the scenarios must be a whole number of at least 0, not {self.seed}")

    @property
    def errs(self) -> bool:
        """Whether the scenarios are pose errors."""
        return self.kind == "pose-errors"

    @property
    def optimised(self) -> int:
        """Number of scenarios to optimise over."""
        return DEFAULT_COUNTS[self.kind][0] if self.count is None else self.count

    @property
    def evaluated(self) -> int:
        """Number of held-out scenarios."""
        return DEFAULT_COUNTS[self.kind][1] if self.held_out is None else self.held_out
