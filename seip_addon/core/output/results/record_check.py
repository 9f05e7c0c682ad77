"""Consistency of a ``placement.json``: figures of a record that follow from each other must agree."""

import math
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from itertools import pairwise

import numpy as np

from ...choosing.placement.objective import MOVED
from ...choosing.placement.returns_summary import share_reached
from .placement_record import PlacementRecord

_CENT = 0.01  # dollars to which prices are rounded
_SHARE_ERROR = 2e-9  # by which a rounded share may exceed another
_VALUE_ERROR = 1e-6  # by which a value may exceed its bound, and gaps may differ, relatively: solvers round
_LARGEST_LOGARITHM = 700.0  # of a float: larger ones cannot be exponentiated
_RETURNS_ERROR = 1e-3  # by which returns, rounded to three digits, may differ, relatively
_GEOGRAPHIC_ERRORS = np.array([1e-6, 1e-6, 1e-5])  # degrees, about 0.1 m, and metres
_COORDINATE_ERROR = 2e-3  # metres: eastings and northings are rounded to the millimetre


def check_consistency(record: PlacementRecord) -> None:
    """Check the figures of a record against each other.

    Raises
    ------
    ValueError
        Two figures contradict each other.
    """
    for check in (
        _check_goal,
        _check_sensors,
        _check_geographic,
        _check_prices,
        _check_coverage,
        _check_objective,
        _check_greedy,
        _check_returns,
        _check_fronts,
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
        planned, height = sensor.pose is not None, sensor.height_m
        _require(
            not planned or height > 0, f"height_m of sensor {sensor.id[:40]!r} is {height:g}, not above the ground"
        )
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


def _check_goal(record: PlacementRecord) -> None:
    """Check the sensors against the objective; sensors moved by hand need not meet it."""
    goal, types, price = record.request.goal, record.request.candidates.sensors, record.price_usd
    other = next((one.sensor for one in record.sensors if one.pose is not None and one.sensor not in types), None)
    _require(other is None, f"the sensor type {str(other)[:40]!r} is not in settings.candidates.sensors")
    if record.objective.status == MOVED:
        return
    number = len(record.sensors)
    _require(goal.count is None or number <= goal.count, f"{number} sensors are more than settings.goal.count")
    _require(
        goal.budget is None or price <= goal.budget * (1 + _VALUE_ERROR) + _CENT,
        f"price_usd {price:g} is above settings.goal.budget",
    )
    _require(record.objective.cheapest == goal.cheapest, "objective.sought is not what settings.goal asks for")


def _check_geographic(record: PlacementRecord) -> None:
    """Check latitudes, longitudes and altitudes against map coordinates."""
    known = record.site.geo_reference
    for sensor in record.sensors:
        recorded = np.array([sensor.longitude_deg, sensor.latitude_deg, sensor.altitude_m], dtype=np.float64)
        if known is None or np.isnan(recorded).any():
            continue
        computed = known.geo_reference.geographic(np.array([sensor.map_m]))
        _require(
            computed is not None and bool((np.abs(recorded - computed[0]) <= _GEOGRAPHIC_ERRORS).all()),
            f"latitude_deg, longitude_deg and altitude_m of sensor {sensor.id[:40]!r} are not those of its map_m",
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
        gap = math.expm1(min(bound - value, _LARGEST_LOGARITHM)) if of_returns else abs(bound - value) / value
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
    better = min(greedy.value, objective.value + _LARGEST_LOGARITHM)
    reached = share_reached(better, objective.value, of_returns=objective.sought == "most returns")
    _require(
        abs(1.0 - reached - greedy.gap_to_placement) <= _VALUE_ERROR,
        f"greedy.gap_to_placement is {greedy.gap_to_placement:g}, but greedy reaches {reached:g} of the objective",
    )


def _check_returns(record: PlacementRecord) -> None:
    returns, objective = record.returns, record.objective
    if returns is None:
        return
    _require(
        objective.sought != "most returns"
        or abs(math.expm1(min(objective.value, _LARGEST_LOGARITHM)) - returns.typical)
        <= _RETURNS_ERROR * (1 + returns.typical),
        f"returns.typical is {returns.typical:g}, but objective.value is the logarithm of "
        f"{math.exp(min(objective.value, _LARGEST_LOGARITHM)):g}",
    )
    earlier = not record.crossings  # records of earlier versions lack them
    _require(earlier or returns.crossings == record.crossings, "returns.crossings and crossings contradict each other")


def _check_fronts(record: PlacementRecord) -> None:
    """Check the best placements with fewer and more sensors: more sensors are no worse, nor is their bound lower."""
    number, price = len(record.sensors), record.price_usd
    covered = [(one.count, one.coverage, one.coverage + one.missed, one.price) for one in record.front]
    returns = [
        (one.count, one.returns, math.inf if one.gap is None else (1 + one.returns) * (1 + one.gap) - 1, one.price)
        for one in (record.returns.front if record.returns else ())
    ]
    for name, front, of_record in (
        ("front", covered, record.coverage.weighted if record.objective.kind == "weighted" else record.coverage.whole),
        ("returns.front", returns, record.returns.typical if record.returns else 0.0),
    ):
        for (count, value, bound, _), (more, better, above, _) in pairwise(front):
            slack = _RETURNS_ERROR * (1 + value)
            _require(
                count < more and value <= better + slack and (bound <= above + slack),
                f"{name} contradicts itself at {more} sensors",
            )
        for count, value, _, its_price in front:
            as_good = count == number and abs(value - of_record) <= _SHARE_ERROR  # ties go to the lower price
            _require(not as_good or its_price <= price + _CENT, f"{name}[].price {its_price:g} is above price_usd")


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
