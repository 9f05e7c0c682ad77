"""Scenarios that a placement is optimised over: nominal poses on the empty road, pose errors, or traffic."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Literal

from ...errors import SeipError
from ...limits import DRAWS, SCENARIOS
from ...settings import setting

MAX_OFFSET_STD, MAX_ANGLE_STD = 100.0, 1.0  # metres and radians; larger standard deviations are taken for typing errors

ScenarioKind = Literal["nominal", "pose-errors", "traffic"]

DEFAULT_COUNTS = {"pose-errors": (20, 500), "traffic": (24, 120)}
"""Number of scenarios to optimise over and of held-out ones, by kind."""


@dataclass(frozen=True)
class PoseErrors:
    """Standard deviations of the errors of a sensor's pose.

    Parameters
    ----------
    position : float, metres
        Standard deviation of x and of y.
    height : float, metres
        Standard deviation of the height.
    yaw : float, radians
        Standard deviation of the yaw.
    tilt : float, radians
        Standard deviation of pitch and of roll.

    Raises
    ------
    SeipError
        A standard deviation is negative or too large.
    """

    position: float = setting(0.3, "standard deviation of x and of y", unit="m", maximum=MAX_OFFSET_STD)
    height: float = setting(0.3, "standard deviation of the height", unit="m", maximum=MAX_OFFSET_STD)
    yaw: float = setting(math.radians(2.0), "standard deviation of the yaw", unit="rad", maximum=math.pi)
    tilt: float = setting(
        math.radians(2.0),
        "standard deviation of pitch and of roll",
        unit="rad",
        maximum=MAX_ANGLE_STD,
    )

    def __post_init__(self) -> None:
        for name in ("position", "height"):
            value = getattr(self, name)
            if not 0 <= value <= MAX_OFFSET_STD:
                raise SeipError(f"the error of {name} must be 0 to {MAX_OFFSET_STD:g} m, not {value:g} m")
        for name, most in (("tilt", MAX_ANGLE_STD), ("yaw", math.pi)):
            value = getattr(self, name)
            if not 0 <= value <= most:
                limit, shown = math.degrees(most), math.degrees(value)
                raise SeipError(f"the error of {name} must be 0 to {limit:.0f}°, not {shown:g}°")

    def alone(self, kind: str) -> PoseErrors:
        """Return the errors of one kind, all others zero."""
        return replace(self, **{name: 0.0 for name in ERROR_KINDS if name != kind})


ERROR_KINDS = tuple(field.name for field in fields(PoseErrors))


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
