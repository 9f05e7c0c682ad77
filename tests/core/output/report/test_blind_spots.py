"""Blind spots, and what is seen of places: against counting by hand and scipy's labels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label

from seip_addon.core.output.report.blind_spots import blind_spots, seen_places, seen_streets
from seip_addon.core.output.report.sections import after_failures
from seip_addon.core.output.results.site_file import Area
from seip_addon.core.site.targets import Targets


def targets_at(places, spacing=2.0, central=()) -> Targets:
    xyz = np.column_stack([spacing * np.asarray(places, dtype=float) + (100.0, -50.0), np.zeros(len(places))])
    inside = np.isin(np.arange(len(xyz)), central)
    return Targets(xyz, np.where(inside, 2.0, 1.0), inside, spacing)


def connected(places) -> list[set]:
    """Return the connected parts of whole places."""
    grid = np.zeros((10, 10), dtype=bool)
    grid[tuple(np.array(places, dtype=np.int64).reshape(-1, 2).T)] = True
    parts, count = label(grid)
    return [set(map(tuple, np.argwhere(parts == number).tolist())) for number in range(1, count + 1)]


@given(st.sets(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=1), st.data())
def test_parts_are_those_that_can_be_walked(places, data):
    places = sorted(places)
    seen = np.array([data.draw(st.booleans()) for _ in places])
    targets = targets_at(places)
    spots = blind_spots(targets, seen, ())
    expected = connected([place for place, one in zip(places, seen, strict=True) if not one])
    assert sorted(sorted(places[t] for t in spot.targets) for spot in spots) == sorted(map(sorted, expected))
    assert [spot.area for spot in spots] == sorted((4.0 * len(part) for part in expected), reverse=True)
    for spot in spots:
        assert any((spot.middle == targets.xyz[t]).all() for t in spot.targets)


def test_places_are_counted_from_the_junction_and_not_from_the_middle_of_a_bounding_box():
    """The junction is at the western end of a street: all that is unseen lies east of it, or in its centre."""
    targets = targets_at([(x, y) for x in range(21) for y in (-1, 0, 1)], central=range(9))
    box = Area("Central box", "weighted region", targets.central)
    x, y = (targets.xyz[:, :2] - (102.0, -50.0)).T
    unseen = (np.abs(y) < 1) & np.isin(x, (0.0, 8.0, 24.0, 26.0, 28.0))
    found = [(spot.area, spot.where) for spot in blind_spots(targets, ~unseen, (box,))]
    assert found == [
        (12.0, "26 m east of the centre"),
        (4.0, "Central box, at the centre"),
        (4.0, "8 m east of the centre"),
    ]


def test_places_have_the_shares_that_counting_gives():
    targets = targets_at([(x, 0) for x in range(8)])
    lane, none = Area("Lane", "place", np.arange(8) < 4), Area("Nowhere", "place", np.zeros(8, dtype=bool))
    (found,) = seen_places(targets, np.array([0, 1, 2, 3, 0, 0, 0, 1]), (lane, none))
    assert (found.name, found.area, found.seen, found.seen_twice) == ("Lane", 16.0, 0.75, 0.5)


@given(st.integers(0, 4), st.integers(0, 2), st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_each_square_belongs_to_one_street_and_the_table_adds_up(streets, weighted, count, seed):
    random = np.random.default_rng(seed)
    targets = targets_at([(x, 0) for x in range(count)], central=range(count // 3))
    kinds = ["place"] * streets + ["weighted region"] * weighted
    areas = [Area(f"A{n}", kind, random.random(count) < 0.5) for n, kind in enumerate(kinds)]
    seen_by = random.integers(0, 4, count)
    *parts, total = seen_streets(targets, seen_by, areas)
    assert (total.name, total.area) == ("Total", 4.0 * count)
    assert sum(one.area for one in parts) == total.area
    for share, wanted in (("seen", seen_by > 0), ("seen_twice", seen_by > 1)):
        assert getattr(total, share) == pytest.approx(wanted.mean())
        assert sum(one.area * getattr(one, share) for one in parts) == pytest.approx(total.area * wanted.mean())


@given(st.integers(1, 5), st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_what_a_failure_leaves_is_the_union_of_the_others(sensors, count, seed):
    rows = np.random.default_rng(seed).random((sensors, count)) < 0.4
    expected = [np.delete(rows, one, axis=0).any(axis=0).mean() for one in range(sensors)]
    assert after_failures(rows) == pytest.approx(expected)
