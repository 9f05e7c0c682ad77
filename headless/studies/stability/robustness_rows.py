"""Results of robustness studies, as rows of the stability page."""

import numpy as np

from seip_addon.core.choosing.robustness.pose_study import LOW_QUANTILE, PoseStudy
from seip_addon.core.choosing.robustness.robust_study import Contender, RobustStudy
from seip_addon.core.choosing.robustness.traffic_study import NOTABLE_LOSS, TrafficEvaluation, TrafficStudy
from seip_addon.core.estimates import mean_of, quantile_gain, quantile_of

from .rows import Row

MOSTLY_SEEN_SHARE = 0.9  # least share of time for which a target must be seen to be mostly seen
QUANTILES = (0.05, 0.5, 0.95)  # of coverage, which must be the same in half of the draws


def pose_rows(study: PoseStudy) -> tuple[Row, ...]:
    """Return the results of the study of pose errors as rows."""
    errors, settings = study.settings.errors, study.settings
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
            f"planned {study.planned:.2%}; 5 % quantile {study.quantile(0.05).describe()}, "
            f"mean {mean_of(study.together).describe()}",
            f"{settings.draws} draws, errors of all sensors; half of them "
            f"{'give the same result' if poses_converged(study) else 'give a different result: take more'}",
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
                f"mean loss of coverage with only one kind of error, {settings.draws_of_kind} draws",
                "tighten the installation tolerance of the most costly kind first",
            )
        )
    return tuple(rows)


def poses_converged(study: PoseStudy) -> bool:
    """Return whether half of the draws give the same mean and quantiles of coverage, within their intervals."""
    whole = study.together
    half = whole[: len(whole) // 2]
    pairs = [(mean_of(half), mean_of(whole)), *((quantile_of(half, q), quantile_of(whole, q)) for q in QUANTILES)]
    return all(one.agrees_with(other) for one, other in pairs)


def robust_rows(study: RobustStudy) -> tuple[Row, ...]:
    """Return the results of the study of robust placements as rows, one for each placement."""
    scenarios, errors = study.scenarios, study.scenarios.pose_errors
    regime = f"σ {errors.position:g} m, {np.degrees(errors.tilt):.3g}°; {scenarios.optimised} scenarios"
    return tuple(
        Row(
            f"placement for {contender.name}",
            regime,
            f"gives away {100 * study.price(contender):.2f} points of planned coverage; 5 % quantile of "
            f"{contender.evaluated_by.describe_outcome()} {contender.low.describe()} against "
            f"{study.beside(contender).low.describe()} of the nominal optimum: "
            f"{study.saving(contender).as_change()}",
            f"{scenarios.evaluated} draws not used in the optimisation; half of them "
            f"{'give the same result' if saving_converged(study, contender) else 'give a different result: take more'}",
            f"certificate: within {contender.placement.gap:.2%} of the best possible objective",
        )
        for contender in study.robust
    )


def saving_converged(study: RobustStudy, contender: Contender) -> bool:
    """Return whether half of the unseen draws give the same gain of a contender, within the intervals."""
    half = len(contender.unseen) // 2
    saved = quantile_gain(contender.unseen[:half], study.beside(contender).unseen[:half], LOW_QUANTILE)
    return saved.agrees_with(study.saving(contender))


def traffic_rows(study: TrafficStudy) -> tuple[Row, ...]:
    """Return the results of the study of traffic as rows."""
    regime = f"{study.road_users:.0f} road users at a time"
    seen, batch = study.empty, study.empty.batch
    how = (
        f"{len(batch)} instants in {len(np.unique(batch))} stretches of time, of runs not used in the optimisation; "
        f"half of them {'give the same result' if study.is_converged() else 'give a different result: take more'}"
    )
    loss = Row(
        "view of the road",
        regime,
        f"{seen.empty:.2%} of the targets' weight is visible on the empty road, {seen.mean.describe()} on average "
        f"over time in traffic: vehicles hide {seen.hidden.describe()} of the visible weight, and "
        f"{_rarely_seen(seen):.1%} of the visible targets are seen less than {MOSTLY_SEEN_SHARE:.0%} of the time",
        how,
        f"a warning if {NOTABLE_LOSS:.0%} of the weight or more is lost, and a map of the share of time",
    )
    gain = Row(
        "placement for the empty road, to see the road",
        regime,
        f"a placement optimised in traffic sees {study.traffic.mean.describe()}, {study.gain.as_change()}",
        f"optimised for {study.chosen_at} instants; {how}",
        f"placement over instants of traffic; certificate: within {study.traffic.placement.gap:.2%} of the best",
    )
    return (loss, gain)


def _rarely_seen(seen: TrafficEvaluation) -> float:
    """Return the share of the targets seen on the empty road that are not mostly seen in traffic."""
    return float((seen.time[seen.empty_targets] < MOSTLY_SEEN_SHARE).mean()) if seen.empty_targets.any() else 0.0
