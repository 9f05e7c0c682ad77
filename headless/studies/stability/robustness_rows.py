"""Results of robustness studies, as rows of the stability page."""

from collections.abc import Sequence

import numpy as np

from seip_addon.core.base.estimates import IntervalEstimate, mean_of
from seip_addon.core.choosing.robustness.comparison import Comparison, EvaluatedPlacement
from seip_addon.core.choosing.robustness.pose_study import NOTABLE_LOSS, PoseStudy

from .page import Row

MOSTLY_SEEN_SHARE = 0.9  # least share of time for which a target must be seen to be mostly seen


def pose_rows(study: PoseStudy) -> tuple[Row, ...]:
    """Return the results of the study of pose errors as rows."""
    errors = study.errors
    losses, kinds = study.loss_by_sensor(), study.loss_by_kind()
    worst, certain = study.worst_sensor()
    regime = (
        f"σ {errors.position:g} m in x and y, {errors.height:g} m in height, {np.degrees(errors.yaw):.3g}° in yaw, "
        f"{np.degrees(errors.tilt):.3g}° in pitch and roll"
    )
    rows = [
        Row(
            "coverage of a placement",
            regime,
            f"planned {study.planned:.2%}; 5 % quantile {study.low.describe()}, "
            f"mean {mean_of(study.together).describe()}",
            f"{len(study.together)} draws, errors of all sensors",
            "placement over pose errors: `seip place --pose-errors`; `--risk none` reports the 5 % quantile",
        ),
        Row(
            "a sensor's own error",
            regime,
            f"{worst} costs most{'' if certain else ' (not significant)'}: "
            + ", ".join(f"{label} {loss.as_points()}" for label, loss in zip(study.labels, losses, strict=True)),
            "mean loss of coverage with errors of only one sensor, the same draws",
            "the warning names the sensor",
        ),
    ]
    if kinds:
        costly = max(kinds, key=lambda kind: kinds[kind].value)
        rows.append(
            Row(
                "a kind of error",
                regime,
                f"{costly} costs most: " + ", ".join(f"{kind} {loss.as_points()}" for kind, loss in kinds.items()),
                f"mean loss of coverage with only one kind of error, {len(study.by_kind[costly])} draws",
                "tighten the installation tolerance of the most costly kind first",
            )
        )
    return tuple(rows)


def robust_rows(comparisons: Sequence[Comparison]) -> tuple[Row, ...]:
    """Return the results of the study of robust placements as rows, one for each placement."""
    scenarios, errors = comparisons[0].scenarios, comparisons[0].scenarios.pose_errors
    regime = f"σ {errors.position:g} m, {np.degrees(errors.tilt):.3g}°; {scenarios.optimised} scenarios"
    return tuple(
        Row(
            f"placement for {one.robust.name}",
            regime,
            f"gives away {100 * one.price:.2f} points of planned coverage; 5 % quantile of "
            f"{one.robust.risk.describe_outcome()} {one.robust.low.describe()} against "
            f"{one.nominal.low.describe()} of the nominal optimum: {one.gain.as_change()}",
            f"{scenarios.evaluated} draws not used in the optimisation",
            f"certificate: within {one.robust.placement.gap:.2%} of the best possible objective",
        )
        for one in comparisons
    )


def traffic_rows(comparison: Comparison) -> tuple[Row, ...]:
    """Return the results of the study of traffic as rows."""
    seen, traffic = comparison.nominal, comparison.robust
    regime = f"{seen.road_users:.0f} road users at a time"
    batches = len(np.unique(seen.instants.batch)) if seen.instants else 0
    how = f"{len(seen.held_out)} instants in {batches} stretches of time, of runs not used in the optimisation"
    loss = Row(
        "view of the road",
        regime,
        f"{seen.nominal:.2%} of the targets' weight is visible on the empty road, {seen.mean.describe()} on average "
        f"over time in traffic: vehicles hide {hidden(seen).describe()} of the visible weight, and "
        f"{_rarely_seen(seen):.1%} of the visible targets are seen less than {MOSTLY_SEEN_SHARE:.0%} of the time",
        how,
        f"a warning if {NOTABLE_LOSS:.0%} of the weight or more is lost, and a map of the share of time",
    )
    gain = Row(
        "placement for the empty road, to see the road",
        regime,
        f"a placement optimised in traffic sees {traffic.mean.describe()}, {comparison.gain.as_change()}",
        f"optimised for {comparison.scenarios.optimised} instants; {how}",
        f"placement over instants of traffic; certificate: within {traffic.placement.gap:.2%} of the best",
    )
    return (loss, gain)


def hidden(placed: EvaluatedPlacement) -> IntervalEstimate:
    """Estimate the share of the targets seen on the empty road that vehicles hide, on average over time."""
    empty, traffic = placed.seen[0], placed.seen[1:]
    return placed.estimate((empty & ~traffic).sum(axis=1) / max(1, np.count_nonzero(empty)))


def _rarely_seen(placed: EvaluatedPlacement) -> float:
    """Return the share of the targets seen on the empty road that are not mostly seen in traffic."""
    time = placed.seen[1:, placed.seen[0]].mean(axis=0)
    return float((time < MOSTLY_SEEN_SHARE).mean()) if len(time) else 0.0
