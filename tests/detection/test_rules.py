"""The table of rules: classes, moving and parked, in plan and in space, each with its interval."""

import math

from headless.detection.rules import RULES, precisions

import pytest

from tests.builders.labelled_frames import SIZES, box, detected, frame, truth

PLACES = [0.0, 30.0, 60.0, 90.0]


def street(runs=4):
    """Runs of a frame each: two cars drive, of two parked ones one is found; a van and a pedestrian are found."""
    told = []
    for number in range(runs):
        cars, van, person = (
            [box(x) for x in PLACES],
            box(120.0, size=SIZES["van"]),
            box(150.0, size=SIZES["pedestrian"]),
        )
        there = truth(
            [*cars, van, person],
            category=["car", "car", "car", "car", "van", "pedestrian"],
            parked=[False, False, True, True, False, False],
        )
        found = detected([*cars[:3], van, person], [0.9, 0.8, 0.7, 0.6, 0.5], category=["car"] * 4 + ["pedestrian"])
        told.append(frame(there, found, run=f"run {number}"))
    return told


def test_moving_and_parked_are_evaluated_apart_and_neither_punishes_the_other():
    found = precisions(street())
    moving, parked = found["bev_0.7_moving"], found["bev_0.7_parked"]
    assert (moving.average_precision, moving.road_users) == (1.0, 12)
    assert (parked.average_precision, parked.road_users) == (0.5, 8)
    assert found["bev_0.7"].average_precision == pytest.approx(4 / 5)


def test_each_class_is_evaluated_at_its_own_overlap():
    found = precisions(street())
    assert (found["car_van_0.7"].road_users, found["pedestrian_0.5"].road_users) == (20, 4)
    assert found["pedestrian_0.5"].average_precision == 1.0
    assert (RULES["motorcycle_bicycle_0.5"].iou, RULES["pedestrian_0.5"].iou, RULES["truck_bus_0.7"].iou) == (
        0.5,
        0.5,
        0.7,
    )
    assert found["truck_bus_0.7"].road_users == 0
    assert math.isnan(found["truck_bus_0.7"].average_precision)
    assert found["truck_bus_0.7"].interval is None
