"""Evaluation of a placement that was optimised for pose errors or sensor failures, as messages."""

from __future__ import annotations

from dataclasses import dataclass

from .pose_study import PoseStudy, pose_warnings
from .robust_study import RobustStudy


@dataclass(frozen=True, eq=False)
class PoseErrorEvaluation:
    """A placement optimised under a risk measure, compared with the nominal optimum on held-out scenarios.

    Parameters
    ----------
    study : RobustStudy
        Study with one robust placement, which is the evaluated one.
    pose_study : PoseStudy or None
        Coverage of the placement under pose errors; None if the scenarios are nominal.
    """

    study: RobustStudy
    pose_study: PoseStudy | None

    def messages(self) -> tuple[str, ...]:
        """Return messages on the loss as planned and the gain under errors, and a warning if errors cost much."""
        (chosen,), nominal = self.study.robust, self.study.nominal[0]
        lost = self.study.price(chosen)
        change = f"{100 * abs(lost):.2f} points {'less' if lost >= 0.0 else 'more'}"
        planned = f"as planned, it covers {change} than the placement for poses as planned"
        if self.pose_study is None:
            outcome = chosen.evaluated_by.describe_outcome()
            return (f"{planned}; {outcome} is {chosen.undisturbed:.2%}, and {nominal.undisturbed:.2%} with that one",)
        verdict = ": this is worse" if chosen.low.value < nominal.low.value else ""
        gain = (
            f"{planned}; {chosen.evaluated_by.describe_outcome()} is at least {chosen.low.describe()} in nineteen of "
            f"twenty of {self.study.scenarios.evaluated} unseen draws, and {nominal.low.describe()} with that "
            f"placement{verdict}"
        )
        return (gain, *pose_warnings(self.pose_study))

    def summary(self) -> tuple[str, ...]:
        """Return lines that compare the placement with the nominal optimum."""
        (chosen,), nominal = self.study.robust, self.study.nominal[0]
        outcome = chosen.evaluated_by.describe_outcome()
        planned = f"planned coverage {chosen.planned:.2%}, the nominal optimum's {nominal.planned:.2%}"
        if self.pose_study is None:
            return (planned, f"{outcome}: {chosen.undisturbed:.2%}, the nominal optimum's {nominal.undisturbed:.2%}")
        return (
            planned,
            f"over {self.study.scenarios.evaluated} unseen draws, {outcome}:",
            f"mean {chosen.mean.describe()}, the nominal optimum's {nominal.mean.describe()}",
            f"5 % quantile {chosen.low.describe()}, the nominal optimum's {nominal.low.describe()}",
            f"the 5 % quantile is higher by {self.study.saving(chosen).describe()}",
        )
