"""Results of robustness studies, as rows of the stability page."""

import numpy as np

from seip_addon.core.choosing.robustness.pose_study import PoseStudy
from seip_addon.core.choosing.robustness.robust_study import RobustStudy
from seip_addon.core.choosing.robustness.traffic_study import LAYER_NAMES, MOSTLY_SEEN_SHARE, NOTABLE_LOSS, TrafficStudy
from seip_addon.core.estimates import mean_of

from .rows import Row


def pose_rows(study: PoseStudy) -> tuple[Row, ...]:
    """Return what the study says as rows of the page of stability."""
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
            f"planned {study.planned.whole[0]:.2%}; 5 % quantile {study.quantile(0.05).describe()}, "
            f"mean {mean_of(study.together.whole).describe()}",
            f"{settings.draws} draws, all sensors erring; half of them "
            f"{'say the same' if study.is_converged() else 'say something else: take more'}",
            "placement over pose errors: `seip place --pose-errors`; `--risk none` reports the 5 % quantile",
        ),
        Row(
            "a sensor's own error",
            regime,
            f"{worst} costs most{'' if certain else ', though not for certain'}: "
            + ", ".join(f"{label} {loss.as_points()}" for label, loss in zip(study.labels, losses, strict=True)),
            "mean loss of coverage when one sensor alone errs, the same draws",
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
                f"mean loss of coverage, each kind alone, {settings.draws_of_kind} draws",
                "set what the installer must hold to by the costly kind first",
            )
        )
    return tuple(rows)


def robust_rows(study: RobustStudy) -> tuple[Row, ...]:
    """Return what the study says as a row of the page of stability for each placement."""
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
            f"{scenarios.evaluated} draws that nothing was chosen on; half of them "
            f"{'say the same' if study.is_converged(contender) else 'say something else: take more'}",
            f"certificate: within {contender.placement.gap:.2%} of the best objective possible",
        )
        for contender in study.robust
    )


def traffic_rows(study: TrafficStudy) -> tuple[Row, ...]:
    """Return what the study says as rows of the page of stability."""
    regime = f"{study.road_users:.0f} road users at a time"
    batch = study.empty.seen[study.layer].batch
    how = (
        f"{len(batch)} instants in {len(np.unique(batch))} stretches of time, of runs that nothing was chosen on; "
        f"every other one {'says the same' if study.is_converged() else 'says something else: take more'}"
    )
    losses = tuple(
        Row(
            f"view of the {LAYER_NAMES[layer]}",
            regime,
            f"of the targets' weight the empty road promises {seen.empty:.2%} and traffic leaves "
            f"{seen.mean.describe()} on average over time; of what the empty road promises vehicles hide "
            f"{seen.hidden.describe()}, and {seen.rarely_seen:.1%} of its targets are seen less than "
            f"{MOSTLY_SEEN_SHARE:.0%} of the time",
            how,
            f"a warning where {NOTABLE_LOSS:.0%} of the weight or more is lost, and a map of the share of time",
        )
        for layer, seen in study.empty.seen.items()
    )
    gain = Row(
        f"placement for the empty road, to see the {LAYER_NAMES[study.layer]}",
        regime,
        f"placing on traffic holds {study.traffic.seen[study.layer].mean.describe()}, "
        f"{study.gain(study.layer).as_change()}",
        f"chosen on {study.chosen_at} instants; {how}",
        f"placement over instants of traffic; certificate: within {study.traffic.placement.gap:.2%} of the best",
    )
    return (*losses, gain)
