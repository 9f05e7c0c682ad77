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


def test_claim_1_asks_for_no_rise_where_all_is_seen():
    assert verdict(1, rising(type2_2=0.995, type2_4=0.999)) == "holds"


def test_claim_1_the_best_type_gains_nothing():
    assert verdict(1, rising(type3_2=0.97)) == "does not hold"
    assert "type3 gains 3.00% from N = 2 to 4" in claim(1, rising(type3_2=0.97)).evidence


def test_claim_1_is_open_where_bounds_or_cells_are_missing():
    assert verdict(1, rising(slack=0.3)) == "undecided"
    assert verdict(1, rising(type2_4=None)) == "undecided"
    assert "no placement" in claim(1, rising(type2_4=None)).evidence
    assert verdict(1, rising(type1_4=None, type2_1=0.3)) == "does not hold"  # the rest says enough


def test_claim_1_counts_what_bounds_leave_open_in_the_best_types_gain():
    """Both were found to see 98 %; that four see no more is not proven."""

    def tell(sensor, height, count, weight):
        if sensor == "type3" and count == 4:
            return Told(0.98, 1.0)
        if sensor == "type3" and count == 2:
            return Told(0.98, 0.98)
        return rising()(sensor, height, count, weight)

    assert verdict(1, tell) == "undecided"


def test_claim_2_needs_all_targets_and_a_sensor_to_spare():
    assert verdict(2, lambda *_: Told(1.0, used=3)) == "holds"
    assert verdict(2, lambda _s, _h, n, _w: Told(1.0 if n == 4 else 0.9, used=4)) == "does not hold"
    assert verdict(2, lambda *_: Told(0.97, used=3)) == "does not hold"
    assert verdict(2, lambda *_: Told(0.97, 1.0, used=3)) == "undecided"
    assert verdict(2, lambda _s, _h, n, _w: None if n == 4 else Told(0.9)) == "undecided"


def test_claim_2_is_open_where_ties_were_not_settled():
    ties = ("the time was too short to break all ties: another placement may cover as much",)
    assert verdict(2, lambda _s, _h, n, _w: Told(1.0 if n == 4 else 0.9, used=4, notes=ties)) == "undecided"
    assert verdict(2, lambda *_: Told(1.0, used=4, notes=ties)) == "holds"  # two sensors see all


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


def test_claim_3_takes_a_tie_for_no_preference():
    tie = claim(3, at_heights(0.5, 0.5))
    assert tie.verdict == "does not hold"
    assert "type2 3.5/5.4/8 m (a tie), " in tie.evidence


def test_claim_3_is_open_where_a_height_has_no_placement():
    def tell(sensor, height, count, weight):
        return None if (sensor, height) == ("type2", 8.0) else at_heights(0.6, 0.5)(sensor, height, count, weight)

    assert verdict(3, tell) == "undecided"


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


def test_claim_4_is_open_where_placements_are_unproven_or_missing():
    assert verdict(4, weighted(proven=False)) == "undecided"
    assert verdict(4, weighted(gain=0.0, proven=False)) == "undecided"
    assert verdict(4, weighted(absent=CENTRAL_WEIGHTS[:1])) == "undecided"
    assert verdict(4, weighted(absent=(1.0,))) == "undecided"


def test_claim_4_says_that_one_of_several_best_placements_is_measured():
    assert "the one returned" in claim(4, weighted()).evidence


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


def test_claims_that_compare_are_left_out_where_there_is_nothing_to_compare():
    one_type = coverage_claims(study(rising(), sensors=("type3",)))
    one_height = coverage_claims(study(rising(), heights=(3.5,)))
    assert [claim.number for claim in one_type] == [2, 10]
    assert [claim.number for claim in one_height] == [1, 2, 4, 10]
    assert [claim.number for claim in coverage_claims(study(rising()))] == [1, 2, 3, 4, 10]
