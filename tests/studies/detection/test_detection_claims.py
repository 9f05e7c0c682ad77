"""Each claim's verdict, both ways and open, on trials that are told and not run."""

import math
import re
from dataclasses import replace

from headless.studies.detection.claims import SeedResult, detection_claims

import pytest

PRICE = {"type1": 6000.0, "type2": 15000.0, "type3": 80000.0}
PUBLISHED = {"type1": (0.60, 0.80, 0.87), "type2": (0.75, 0.85, 0.90), "type3": (0.90, 0.91, 0.91)}
FALSE = (5.0, 3.0, 1.0)
SPREAD = (-0.004, 0.0, 0.004)


def trials(precision=None, *, false=FALSE, sparse=0.8, spread=SPREAD, padded=None):
    told = []
    for sensor, reached in (PUBLISHED if precision is None else precision).items():
        way = 1 if sensor == "type1" else -1  # seeds that suit one type do not suit another
        for count, value, wrong in zip((1, 2, 4), reached, false, strict=True):
            for seed, off in enumerate(spread):
                one = SeedResult(
                    sensor=sensor,
                    count=count,
                    seed=seed,
                    average_precision=value + way * off * count,  # gains vary as well, not the level alone
                    price=PRICE[sensor] * count,
                    coverage=0.9,
                    false_positives=wrong + off,
                    sparse=sparse + off,
                )
                told.append(one)
                if padded is not None and sensor == "type1":
                    told.append(replace(one, false_positives=wrong + padded, sparse=sparse, padded=True))
    return told


def verdicts(*told, **more):
    return {claim.number: claim.verdict for claim in detection_claims(trials(*told, **more))}


def evidence(number, *told, **more):
    return next(claim.evidence for claim in detection_claims(trials(*told, **more)) if claim.number == number)


def test_the_published_figures_hold():
    assert verdicts() == dict.fromkeys((5, 6, 7, 8), "holds")


def test_half_and_twice_the_gain_is_about_it():
    assert verdicts({"type1": (0.50, 0.62, 0.69)})[5] == "holds"  # 12 and 7 points
    assert verdicts({"type1": (0.40, 0.76, 0.87)})[5] == "holds"  # 36 and 11
    assert verdicts({"type1": (0.50, 0.55, 0.62)})[5] == "does not hold"  # 5 and 7
    assert verdicts({"type1": (0.30, 0.65, 0.90)})[5] == "does not hold"  # 35 and 25
    assert verdicts({"type1": (0.50, 0.60, 0.67)})[5] == "undecided"  # 10 is half of 20


def test_seeds_that_disagree_decide_nothing():
    assert verdicts(spread=(-0.1, 0.0, 0.1)) == dict.fromkeys((5, 6, 7), "undecided") | {8: "holds"}


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_seeds_decide_nothing(count):
    assert set(verdicts(spread=SPREAD[:count]).values()) == {"undecided"}
    assert f"{count} seed" in evidence(5, spread=SPREAD[:count])


def decided(**changed):
    return {claim.number: claim for claim in detection_claims([replace(one, **changed) for one in trials(padded=1.0)])}


def test_nothing_is_decided_of_detectors_that_find_next_to_nothing():
    """An AP of 0.2 % everywhere would refute the gains of claims 5 to 7."""
    untrained = decided(average_precision=0.002)
    assert {claim.verdict for claim in untrained.values()} == {"undecided"}
    for claim in untrained.values():
        assert claim.evidence.startswith("no verdict, as the detectors reach an AP of 0.2% with the best")
        assert "below 30% they support no conclusion" in claim.evidence
    assert {claim.verdict for claim in decided().values()} == {"holds"}


def test_nothing_is_decided_while_validation_still_rises():
    rising = decided(still_rising=True)
    assert {claim.verdict for claim in rising.values()} == {"undecided"}
    assert (
        "validation AP was still rising when 3 of 3 trainings ended: train longer, with --steps" in rising[5].evidence
    )
    assert "6 of 6 trainings" in rising[9].evidence


def test_a_training_that_still_rises_speaks_for_its_own_claims_alone():
    told = [replace(one, still_rising=one.padded) for one in trials(padded=1.0)]
    verdicts = {claim.number: claim.verdict for claim in detection_claims(told)}
    assert verdicts == {5: "holds", 6: "holds", 7: "holds", 8: "holds", 9: "undecided"}


@pytest.mark.parametrize(("false", "share"), [((60.0, 3.0, 1.0), 0.9), ((0.1, 0.02, 0.01), 0.02)])
def test_no_count_is_below_nought_and_no_share_beyond_a_hundred(false, share):
    words = evidence(8, false=false, sparse=share, spread=(-0.01, 0.0, 0.09))
    ends = [float(number) for number in re.findall(r"-?[0-9.]+(?= to|\))", words.replace("per frame:", ""))]
    assert min(ends) >= 0.0
    assert max(float(end) for end in re.findall(r"to ([0-9.]+) ?%?\)", words.partition("sparser half")[2])) <= 100.0


def test_the_simplest_type_has_to_gain_more_than_every_other():
    assert verdicts(PUBLISHED | {"type3": (0.50, 0.80, 0.92)})[7] == "does not hold"
    assert verdicts(PUBLISHED | {"type3": (0.63, 0.80, 0.90)})[7] == "undecided"


def test_false_positives_have_to_be_more_and_in_sparse_places():
    assert verdicts(false=(5.0, 3.0, 4.0))[8] == "does not hold"
    assert verdicts(sparse=0.3)[8] == "does not hold"
    assert verdicts(sparse=0.5)[8] == "undecided"
    assert verdicts(sparse=math.nan)[8] == "undecided"
    assert "not measured" in evidence(8, sparse=math.nan)


def test_padding_is_evaluated_where_it_was_tried():
    assert verdicts(padded=1.0)[9] == "holds"
    assert verdicts(padded=-0.5)[9] == "does not hold"
    assert verdicts(padded=0.0)[9] == "undecided"
    assert "type1, N = 1: 4.80 (4.80 to 4.80) padded, 4.00 (3.94 to 4.06) masked" in evidence(9, padded=1.0)


def test_what_is_missing_is_left_out_or_undecided():
    assert detection_claims([]) == ()
    assert set(verdicts({"type1": PUBLISHED["type1"]})) == {5, 8}
    without_four = [trial for trial in trials() if trial.count != 4]
    claims = {claim.number: claim for claim in detection_claims(without_four)}
    assert {claims[number].verdict for number in (5, 6, 7, 8)} == {"undecided"}
    assert "2 to 4: not measured" in claims[5].evidence


def test_evidence_gives_gains_intervals_and_prices():
    """Gains of type 1 from N = 1 to 2 are 20 points and −0.4, 0, 0.4: t = 4.303 gives ± 4.303 · 0.4/√3 = 0.99."""
    assert evidence(5).startswith("1 to 2: +20.0 points (+19.0 to +21.0); 2 to 4: +7.0 points (")
    # 27 points for 18,000 dollars, 15 points for 45,000.
    assert "+1.50 for each $1,000" in evidence(7)
    assert "+0.33 for each $1,000" in evidence(7)
