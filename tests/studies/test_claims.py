"""Verdicts at their edges."""

from headless.studies.claims import verdict_above, verdict_within, worst_verdict


def test_verdicts():
    assert verdict_above((0.01, 0.2)) == "holds"
    assert verdict_above((-0.2, 0.0)) == "does not hold"
    assert verdict_above((-0.01, 0.2)) == "undecided"
    assert verdict_above((0.4, 0.6), 0.5) == "undecided"
    assert verdict_within((0.1, 0.2), 0.1, 0.4) == "holds"
    assert verdict_within((0.05, 0.2), 0.1, 0.4) == "undecided"
    assert verdict_within((0.0, 0.09), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.41, 0.5), 0.1, 0.4) == "does not hold"
    assert verdict_within((0.0, 0.9), 0.1, 0.4) == "undecided"
    assert worst_verdict(["holds", "undecided", "holds"]) == "undecided"
    assert worst_verdict(["undecided", "does not hold"]) == "does not hold"
    assert worst_verdict(["holds"]) == "holds"
