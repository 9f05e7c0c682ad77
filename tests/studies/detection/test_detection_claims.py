"""Each claim's verdict, both ways and open, on trials that are told and not run."""

from headless.studies.detection.claims import SeedResult, detection_claims

PRICE = {"type1": 6000.0, "type2": 15000.0, "type3": 80000.0}
PUBLISHED = {"type1": (0.60, 0.80, 0.87), "type2": (0.75, 0.85, 0.90), "type3": (0.90, 0.91, 0.91)}
FALSE = (5.0, 3.0, 1.0)
SPREAD = (-0.004, 0.0, 0.004)


def trials(precision=None, *, false=FALSE, sparse=0.8, spread=SPREAD):
    told = []
    for sensor, reached in (PUBLISHED if precision is None else precision).items():
        way = 1 if sensor == "type1" else -1  # seeds that suit one type do not suit another
        for count, value, wrong in zip((1, 2, 4), reached, false, strict=True):
            for seed, off in enumerate(spread):
                told.append(
                    SeedResult(
                        sensor=sensor,
                        count=count,
                        seed=seed,
                        average_precision=value + way * off * count,  # gains vary as well, not the level alone
                        price=PRICE[sensor] * count,
                        coverage=0.9,
                        false_positives=wrong + off,
                        sparse=sparse + off,
                    )
                )
    return told


def verdicts(*told, **more):
    return {claim.number: claim.verdict for claim in detection_claims(trials(*told, **more))}


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


def test_the_simplest_type_has_to_gain_more_than_every_other():
    assert verdicts(PUBLISHED | {"type3": (0.50, 0.80, 0.92)})[7] == "does not hold"
    assert verdicts(PUBLISHED | {"type3": (0.63, 0.80, 0.90)})[7] == "undecided"
