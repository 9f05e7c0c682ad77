"""Each claim's verdict, both ways and open, on studies that are told and not solved."""

from dataclasses import dataclass

from headless.studies.coverage.cells import CENTRAL_WEIGHTS, COUNTS, Case, CoverageStudy, EmptyCell
from headless.studies.coverage.claims import coverage_claims

import pytest

TYPES, HEIGHTS, TARGETS = ("type1", "type2", "type3"), (3.5, 5.4, 8.0), 1000


@dataclass(frozen=True)
class Answer:
    """What the judgement reads of a placement."""

    objective: float
    bound: float
    chosen: tuple[int, ...]
    status: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class View:
    coverage: float
    central: float


@dataclass(frozen=True)
class Told:
    """One cell: least and largest possible coverage, sensors used, what greedy reaches, the centre's coverage."""

    low: float
    high: float | None = None
    used: int = 1
    greedy: float = 1.0
    central: float = 0.5
    notes: tuple[str, ...] = ()
    proven: bool | None = None

    def case(self, sensor, height, count, weight):
        high = self.low if self.high is None else self.high
        proven = high == self.low if self.proven is None else self.proven
        status = "optimal" if proven else "feasible"
        used = tuple(range(self.used))
        answer = Answer(self.low * TARGETS, high * TARGETS, used, status, self.notes)
        greedy = Answer(self.greedy * self.low * TARGETS, high * TARGETS, used, "feasible")
        return Case(sensor, height, count, weight, answer, greedy, View(self.low, self.central))


def study(tell, sensors=TYPES, heights=HEIGHTS):
    """A study of what ``tell(sensor, height, count, weight)`` says; None where there is no placement."""
    keys = [(s, h, n, 1.0) for s in sensors for h in (*heights, None) for n in COUNTS]
    keys += [(s, None, n, w) for s in sensors for n in COUNTS for w in CENTRAL_WEIGHTS]
    told = [(key, tell(*key)) for key in keys]
    cells = [EmptyCell(*key, "no room") if cell is None else cell.case(*key) for key, cell in told]
    return CoverageStudy(sensors, heights, tuple(cells), TARGETS)


def claim(number, tell, **shape):
    return next(claim for claim in coverage_claims(study(tell, **shape)) if claim.number == number)


def verdict(number, tell, **shape):
    return claim(number, tell, **shape).verdict


RISING = {
    ("type1", 1): 0.3, ("type1", 2): 0.5, ("type1", 4): 0.7,
    ("type2", 1): 0.5, ("type2", 2): 0.7, ("type2", 4): 0.9,
    ("type3", 1): 0.9, ("type3", 2): 0.995, ("type3", 4): 1.0,
}  # fmt: skip


def rising(*, slack=0.0, **other):
    """Coverage as claim 1 has it, each bound a slack above, with some cells told otherwise, by ``type_count``."""
    shares = RISING | {(key.split("_")[0], int(key.split("_")[1])): value for key, value in other.items()}

    def tell(sensor, _height, count, _weight):
        share = shares[sensor, count]
        return None if share is None else Told(share, min(share + slack, 1.0))

    return tell


def test_claim_1_asks_for_more_than_a_negligible_rise():
    assert verdict(1, rising()) == "holds"
    assert verdict(1, lambda *_: Told(0.5)) == "does not hold"
    assert verdict(1, rising(type1_4=0.505)) == "does not hold"  # half a per cent over N = 2
    assert verdict(1, rising(type2_1=0.3)) == "does not hold"  # no better than type 1


def test_claim_2_needs_all_targets_and_a_sensor_to_spare():
    assert verdict(2, lambda *_: Told(1.0, used=3)) == "holds"
    assert verdict(2, lambda _s, _h, n, _w: Told(1.0 if n == 4 else 0.9, used=4)) == "does not hold"
    assert verdict(2, lambda *_: Told(0.97, used=3)) == "does not hold"
    assert verdict(2, lambda *_: Told(0.97, 1.0, used=3)) == "undecided"
    assert verdict(2, lambda _s, _h, n, _w: None if n == 4 else Told(0.9)) == "undecided"


def at_heights(low_height, high_height, *, slack=0.0):
    """Type 1 sees one share at the lowest height and another at the higher ones; the other types the reverse."""

    def tell(sensor, height, _count, _weight):
        share = low_height if (height == HEIGHTS[0]) == (sensor == TYPES[0]) else high_height
        return Told(share, share + slack)

    return tell


def test_claim_3_follows_the_heights():
    assert verdict(3, at_heights(0.6, 0.5)) == "holds"
    assert verdict(3, at_heights(0.5, 0.6)) == "does not hold"
    assert verdict(3, at_heights(0.6, 0.5, slack=0.2)) == "undecided"


def weighted(*, gain=0.1, loss=0.0, best_gain=0.0, proven=True, absent=()):
    """Weighting adds to the centre's coverage and takes from the whole's."""

    def tell(sensor, _height, _count, weight):
        if weight in absent:
            return None
        on = weight != 1.0
        central = 0.5 + on * (best_gain if sensor == TYPES[-1] else gain)
        return Told(0.6 - on * loss, central=central, proven=proven or not on)

    return tell


def test_claim_4_weighs_gain_against_loss():
    assert verdict(4, weighted()) == "holds"
    assert verdict(4, weighted(loss=0.2)) == "does not hold"
    assert verdict(4, weighted(gain=0.0)) == "does not hold"
    assert verdict(4, weighted(best_gain=0.1)) == "does not hold"


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        (Told(0.8, greedy=0.9), "holds"),
        (Told(0.8, greedy=0.1), "does not hold"),
        (Told(0.5, 1.0, greedy=0.9), "undecided"),
        (Told(0.5, 1.0, greedy=0.1), "does not hold"),
    ],
)
def test_claim_10_compares_greedy_with_what_the_optimum_can_be(cell, says):
    assert verdict(10, lambda *_: cell) == says
