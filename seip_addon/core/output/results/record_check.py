"""Consistency of a ``placement.json``: figures of a record that follow from each other must agree."""

import math
from collections import Counter
from collections.abc import Sequence
from datetime import datetime

from .placement_record import PlacementRecord

_CENT = 0.01  # dollars to which prices are rounded
_SHARE_ERROR = 2e-9  # by which a rounded share may exceed another
_VALUE_ERROR = 1e-6  # by which a value may exceed its bound, and gaps may differ, relatively: solvers round
_COORDINATE_ERROR = 2e-3  # metres: eastings and northings are rounded to the millimetre


def check_consistency(record: PlacementRecord) -> None:
    """Check the figures of a record against each other.

    Raises
    ------
    ValueError
        Two figures contradict each other.
    """
    for check in (
        _check_sensors,
        _check_prices,
        _check_coverage,
        _check_objective,
        _check_greedy,
        _check_counts,
        _check_times,
    ):
        check(record)


def _check_sensors(record: PlacementRecord) -> None:
    for what, values in (
        ("id", [sensor.id for sensor in record.sensors]),
        ("pose", [sensor.pose for sensor in record.sensors if sensor.pose is not None]),
    ):
        value, times = Counter(values).most_common(1)[0] if values else (None, 0)
        _require(times <= 1, f"{times} sensors have the {what} {str(value)[:40]!r}")
    for sensor in record.sensors:
        distance = max(
            abs(local + origin - on_map)
            for local, origin, on_map in zip(sensor.local_m, record.site.origin_m, sensor.map_m, strict=True)
        )
        _require(distance <= 1e-5, f"local_m and map_m of sensor {sensor.id[:40]!r} are {distance:g} m apart")
        known, projected = record.site.geo_reference, (sensor.easting_m, sensor.northing_m)
        if known is not None:
            for on_map, offset, value in zip(sensor.map_m, known.header_offset_m, projected, strict=False):
                _require(
                    value is None or abs(on_map + offset - value) <= _COORDINATE_ERROR,
                    f"easting_m and northing_m of sensor {sensor.id[:40]!r} are not its map_m with the map's offset",
                )


def _check_prices(record: PlacementRecord) -> None:
    prices = [sensor.price_usd for sensor in record.sensors]
    _require_sum("price_usd", record.price_usd, "the prices of the sensors", prices, _CENT)
    for sensor in record.sensors:
        _require(
            (sensor.installation_usd or 0.0) <= sensor.price_usd + _CENT,
            f"sensor {sensor.id[:40]!r} costs less than its installation",
        )


def _check_coverage(record: PlacementRecord) -> None:
    coverage = record.coverage
    _require(coverage.seen_twice <= coverage.whole + _SHARE_ERROR, "coverage.seen_twice is above coverage.whole")
    added = [sensor.coverage_added for sensor in record.sensors]
    _require_sum("coverage.whole", coverage.whole, "the sensors", added, _SHARE_ERROR)
    for sensor in record.sensors:
        _require(
            sensor.coverage_marginal <= sensor.coverage_added + _SHARE_ERROR
            and sensor.coverage_added <= sensor.coverage_alone + _SHARE_ERROR
            and sensor.coverage_alone <= coverage.whole + _SHARE_ERROR,
            f"the coverages of sensor {sensor.id[:40]!r} contradict each other",
        )


def _check_objective(record: PlacementRecord) -> None:
    objective = record.objective
    if objective.bound is None:
        return
    slack = _VALUE_ERROR * max(objective.value, objective.bound, 1.0)
    value, bound = objective.value, objective.bound
    beyond = value < bound - slack if objective.cheapest else value > bound + slack
    _require(not beyond, f"objective.value {value:g} is better than objective.bound {bound:g}")
    _require(
        objective.status != "optimal" or abs(bound - value) <= slack,
        f"objective.status is 'optimal', but objective.bound {bound:g} is not objective.value {value:g}",
    )
    if objective.gap is not None and value > 0:
        of_returns = objective.sought == "most returns"  # whose values are logarithms
        gap = math.expm1(min(bound - value, 700.0)) if of_returns else abs(bound - value) / value
        _require(
            abs(objective.gap - gap) <= _VALUE_ERROR * (1 + gap),
            f"objective.gap is {objective.gap:g}, but the gap of value and bound is {gap:g}",
        )


def _check_greedy(record: PlacementRecord) -> None:
    objective, greedy = record.objective, record.greedy
    if greedy is None or objective.bound is None or objective.cheapest:
        return
    slack = _VALUE_ERROR * max(objective.bound, 1.0)
    _require(
        greedy.value <= objective.bound + slack,
        f"greedy.value {greedy.value:g} is above objective.bound {objective.bound:g}",
    )


def _check_times(record: PlacementRecord) -> None:
    try:
        datetime.fromisoformat(record.times.created)
    except ValueError:
        _require(False, f"times.created is not a date and time: {record.times.created[:40]!r}")  # noqa: FBT003


def _check_counts(record: PlacementRecord) -> None:
    counts = record.counts
    _require(counts.targets_central <= counts.targets, "counts.targets_central is above counts.targets")
    _require(counts.positions_on_poles <= counts.positions, "counts.positions_on_poles is above counts.positions")
    poses = [sensor.pose for sensor in record.sensors] + list(record.greedy.poses if record.greedy else ())
    highest = max((pose for pose in poses if pose is not None), default=-1)
    _require(highest < counts.poses, f"a sensor has the pose {highest}, but poses end at {counts.poses - 1}")


def _require_sum(name: str, value: float, what: str, parts: Sequence[float], error: float) -> None:
    """Require a value to be the sum of its parts; each number may be rounded by an error."""
    total = sum(parts)
    fault = f"{name} is {value:g}, but {what} add up to {total:g}"
    _require(abs(total - value) <= error * (1 + len(parts)), fault)


def _require(holds: bool, fault: str) -> None:  # noqa: FBT001 -- a condition
    if not holds:
        raise ValueError(fault)
