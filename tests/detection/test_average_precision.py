"""Average precision by hand, against another's evaluation, and by what must hold whatever is detected."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.special
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.builders.labelled_frames import SIZES, box, detected, frame, traffic, truth

pytest.importorskip("torch", reason="the detector's torch is optional")

from headless.detection.average_precision import (
    CountedTruth,
    EvaluatedDetections,
    Evaluation,
    average_precision_interval,
    balanced_score,
    evaluate,
    precision_recall,
    too_few_runs,
)
from headless.detection.matching import NO_MATCH, VEHICLES, Rule, match

from seip_addon.core.errors import SeipError

AT_07 = Rule()
FAR = 500.0  # where nobody is


def average_precision(frames, rule=AT_07):
    return evaluate(frames, rule).average_precision


# Worked examples ------------------------------------------------------------------------------------------------


def test_example_with_one_missed_and_two_false():
    """Three cars; by score: found 0.9, false 0.8, found 0.7, false 0.6. The third car is missed.

    Precision after each 1/1, 1/2, 2/3, 2/4; recall 1/3, 1/3, 2/3, 2/3. The best precision at recall 1/3 is 1, at 2/3
    it is 2/3, beyond there is none: 1/3 · 1 + 1/3 · 2/3 + 1/3 · 0 = 5/9.
    """
    told = frame(
        truth([box(0), box(20), box(40)]), detected([box(0), box(FAR), box(20), box(-FAR)], [0.9, 0.8, 0.7, 0.6])
    )
    evaluation = evaluate([told], AT_07)
    assert evaluation.average_precision == pytest.approx(5 / 9, abs=1e-15)
    curve = precision_recall(evaluation)
    assert curve.precision.tolist() == pytest.approx([1, 1 / 2, 2 / 3, 2 / 4])
    assert curve.recall.tolist() == pytest.approx([1 / 3, 1 / 3, 2 / 3, 2 / 3])
    assert evaluation.wanted.score.tolist() == [0.9, 0.7, -math.inf]
    # F1 is 2/4, 2/5, 4/6 and 4/7 (twice the hits over detections plus road users): the third is best.
    assert balanced_score(evaluation) == 0.7


def test_scores_are_sorted_over_all_frames():
    """One car in each of two frames; a false detection of the second scores between the hits.

    Precision 1/1, 1/2, 2/3 at recall 1/2, 1/2, 1: 1/2 · 1 + 1/2 · 2/3 = 5/6. Frame by frame it would be 1 and 1/2.
    """
    first = frame(truth([box(0)]), detected([box(0)], [0.5]))
    second = frame(truth([box(0)]), detected([box(0), box(FAR)], [0.9, 0.7]))
    assert average_precision([first, second]) == pytest.approx(5 / 6, abs=1e-15)


def test_precision_rises_again_with_later_hits():
    """False 0.9, then three hits of three cars: precision 0, 1/2, 2/3, 3/4, of which 3/4 is the best everywhere."""
    boxes = [box(0), box(20), box(40)]
    told = frame(truth(boxes), detected([box(FAR), *boxes], [0.9, 0.8, 0.7, 0.6]))
    assert average_precision([told]) == pytest.approx(3 / 4, abs=1e-15)


def test_equal_scores_are_one_point_of_the_curve():
    """A hit and a false detection of equal score, in whatever order: precision 1/2 at recall 1."""
    for boxes in ([box(0), box(FAR)], [box(FAR), box(0)]):
        assert average_precision([frame(truth([box(0)]), detected(boxes, [0.5, 0.5]))]) == 0.5


def test_a_car_is_found_once():
    """Two good detections of one car: the second is false, the first gives recall 1 at precision 1."""
    told = frame(truth([box(0)]), detected([box(0.1), box(0)], [0.9, 0.8]))
    found = match(told, AT_07)
    assert found.hit.tolist() == [True, False]
    assert found.evaluated.tolist() == [True, True]
    assert found.found_by.tolist() == [0]
    assert average_precision([told]) == 1


def test_the_better_overlap_goes_first_among_equal_scores():
    told = frame(truth([box(0)]), detected([box(0.3), box(0)], [0.8, 0.8]))
    assert match(told, AT_07).hit.tolist() == [False, True]


def test_overlap_decides():
    """Shifted by d along its 4.5 m, a car shares (4.5 − d)/(4.5 + d): 0.7 at d = 0.794, 0.5 at d = 1.5."""
    for shift, found, loosely in ((0.79, True, True), (0.80, False, True), (1.49, False, True), (1.51, False, False)):
        told = frame(truth([box(0)]), detected([box(shift)], [0.9]))
        assert match(told, AT_07).hit.tolist() == [found]
        assert match(told, Rule(iou=0.5)).hit.tolist() == [loosely]


def test_overlap_in_space_takes_height_into_account():
    raised = np.array(box(0))
    raised[2] += 0.3  # shares 1.2/1.8 in height: 0.667
    told = frame(truth([box(0)]), detected([raised], [0.9]))
    assert match(told, AT_07).hit.tolist() == [True]
    assert match(told, Rule(in_space=True)).hit.tolist() == [False]
    assert match(told, Rule(in_space=True, iou=0.66)).hit.tolist() == [True]


def test_who_does_not_count_neither_helps_nor_harms():
    """Outside the region, without returns, or of another category: found or not, nothing changes."""
    boxes = [box(0), box(20), box(40), box(60)]
    there = truth(
        boxes,
        category=["car", "car", "car", "pedestrian"],
        points=[9, 9, 0, 9],
        inside=[True, False, True, True],
    )
    rule = replace(AT_07, fewest_points=1)
    for rows in ([0], [0, 1], [0, 1, 2, 3]):
        told = frame(there, detected([boxes[row] for row in rows], np.linspace(0.5, 0.9, len(rows))))
        assert average_precision([told], rule) == 1
        assert match(told, rule).evaluated.tolist() == [True] + [False] * (len(rows) - 1)
    assert len(evaluate([frame(there, detected([], []))], AT_07).wanted) == 2  # the car without returns counts here


def test_false_detections_outside_the_region_do_not_count_but_hits_do():
    """The region ends at x = 0: a car just inside, found just outside, is found; what else lies outside is let be."""
    told = frame(truth([box(0)]), detected([box(0.1), box(FAR)], [0.8, 0.9], inside=False))
    assert match(told, AT_07).evaluated.tolist() == [True, False]
    assert average_precision([told]) == 1


def test_detections_of_other_kinds_are_let_be():
    told = frame(
        truth([box(0, size=SIZES["truck"])], category="truck"),
        detected([box(0, size=SIZES["truck"]), box(FAR)], [0.8, 0.9], category=["car", "pedestrian"]),
    )
    assert average_precision([told]) == 1  # a truck taken for a car is a vehicle that was found
    assert average_precision([told], replace(AT_07, categories=("truck",))) == 0  # but not as a truck


def test_the_free_car_is_taken_where_two_overlap_enough():
    """Two cars 1 m apart overlap (3.5/5.5 = 0.64); both detections lie nearest to the first."""
    told = frame(truth([box(0), box(1.0)]), detected([box(0), box(0.4)], [0.9, 0.8]))
    found = match(told, Rule(iou=0.5))
    assert found.found.tolist() == [0, 1]
    assert found.found_by.tolist() == [0, 1]


def test_frames_without_vehicles_or_detections():
    nothing = frame(truth([]), detected([], []))
    false = frame(truth([]), detected([box(0)], [0.9]))
    missed = frame(truth([box(0)]), detected([], []))
    assert match(missed, AT_07).found_by.tolist() == [NO_MATCH]
    assert average_precision([nothing, missed]) == 0
    assert average_precision([false, frame(truth([box(0)]), detected([box(0)], [0.5]))]) == 0.5
    assert balanced_score(evaluate([missed], AT_07)) == 0
    for frames in ([], [nothing], [nothing, false]):
        with pytest.raises(SeipError, match=f"none of {len(frames)} frames has a car or van or truck or bus"):
            evaluate(frames, AT_07)


# Another's evaluation ---------------------------------------------------------------------------------------------


def records(frames, *, is_truth):
    for number, told in enumerate(frames):
        boxes = told.truth.boxes if is_truth else told.detected.boxes
        for row, (x, y, z, length, width, height, yaw) in enumerate(boxes.tolist()):
            record = {
                "sample_token": str(number),
                "translation": [x, y, z],
                "size": [width, length, height],
                # It reads sin(yaw) from the place where the matrix has its negative.
                "rotation": [math.cos(-yaw / 2), 0.0, 0.0, math.sin(-yaw / 2)],
                "name": "car",
            }
            yield record if is_truth else record | {"score": float(told.detected.score[row])}


@pytest.mark.slow
@pytest.mark.parametrize("iou", [0.5, 0.7])
def test_agrees_with_the_lyft_kit(iou):
    """Lyft's kit evaluates in space; its cars stand apart, where its rule and ours are the same."""
    kit = pytest.importorskip(
        "lyft_dataset_sdk.eval.detection.mAP_evaluation",
        reason="pip install --no-deps --group second-opinion",
    )
    for seed in range(3):
        frames = traffic(seed, frames=40)
        theirs = kit.get_average_precisions(
            list(records(frames, is_truth=True)), list(records(frames, is_truth=False)), ["car"], iou
        )[0]
        ours = average_precision(frames, Rule(iou=iou, in_space=True))
        assert 0.05 < ours < 0.95
        assert ours == pytest.approx(theirs, abs=1e-6)


# Properties -------------------------------------------------------------------------------------------------------


def test_perfect_detection_scores_one():
    told = [
        replace(one, detected=detected(one.truth.boxes, np.linspace(0.2, 0.9, len(one.truth)))) for one in traffic(1)
    ]
    for rule in (AT_07, Rule(iou=0.99), Rule(iou=0.99, in_space=True)):
        assert average_precision(told, rule) == 1


seeds = st.integers(0, 2**31)


def small(seed):
    return traffic(seed, frames=4, cars=6)


@settings(deadline=None)
@given(seeds, st.data())
def test_removing_a_false_detection_never_harms(seed, data):
    frames = small(seed)
    before = average_precision(frames)
    false = [
        (number, row) for number, told in enumerate(frames) for row in np.nonzero(~match(told, AT_07).hit)[0].tolist()
    ]
    if not false:
        return
    number, row = data.draw(st.sampled_from(false))
    frames[number] = replace(
        frames[number],
        detected=replace(
            frames[number].detected,
            **{name: np.delete(value, row, axis=0) for name, value in vars(frames[number].detected).items()},
        ),
    )
    assert average_precision(frames) >= before - 1e-12


@settings(deadline=None)
@given(seeds, seeds)
def test_the_order_does_not_matter(seed, shuffle):
    frames, rng = small(seed), np.random.default_rng(shuffle)
    frames = [replace(told, detected=replace(told.detected, score=np.round(told.detected.score, 1))) for told in frames]
    mixed = [
        replace(
            frames[number],
            truth=shuffled(frames[number].truth, rng),
            detected=shuffled(frames[number].detected, rng),
        )
        for number in rng.permutation(len(frames))
    ]
    assert average_precision(mixed) == pytest.approx(average_precision(frames), abs=1e-12)


def shuffled(table, rng):
    order = rng.permutation(len(table))
    return replace(table, **{name: value[order] for name, value in vars(table).items()})


@settings(deadline=None)
@given(seeds, st.floats(-7, 7), st.floats(-200, 200), st.floats(-200, 200))
def test_moving_the_world_does_not_matter(seed, turn, east, north):
    frames = small(seed)
    moved = [
        replace(
            told,
            truth=replace(told.truth, boxes=carried(told.truth.boxes, turn, east, north)),
            detected=replace(told.detected, boxes=carried(told.detected.boxes, turn, east, north)),
        )
        for told in frames
    ]
    for rule in (AT_07, Rule(in_space=True)):
        assert average_precision(moved, rule) == pytest.approx(average_precision(frames, rule), abs=1e-12)


def carried(boxes, turn, east, north):
    x, y, z, *size, yaw = boxes.T
    cosine, sine = math.cos(turn), math.sin(turn)
    return np.column_stack([cosine * x - sine * y + east, sine * x + cosine * y + north, z, *size, yaw + turn])


@settings(deadline=None)
@given(seeds)
def test_a_lower_bar_finds_no_less(seed):
    frames = small(seed)
    recall = [np.isfinite(evaluate(frames, Rule(iou=iou)).wanted.score).mean() for iou in (0.3, 0.5, 0.7, 0.9)]
    assert recall == sorted(recall, reverse=True)


# Its interval -----------------------------------------------------------------------------------------------------


def runs_of(count, **told):
    return [one for number in range(count) for one in traffic(number, run=f"run {number}", **told)]


def test_interval_holds_the_estimate_and_repeats():
    evaluation = evaluate(runs_of(8, frames=15), AT_07)
    low, high = average_precision_interval(evaluation)
    assert low < evaluation.average_precision < high
    assert 0.005 < high - low < 0.2
    assert average_precision_interval(evaluation) == (low, high)


def test_repeated_frames_give_no_certainty():
    """Each frame 20 times within its run: as sure as with one of them, and not √20 times as sure."""
    once = runs_of(6, frames=2)
    often = [replace(told, time=told.time + 0.5 * step) for told in once for step in range(20)]
    single, repeated = (average_precision_interval(evaluate(frames, AT_07)) for frames in (once, often))
    assert repeated == pytest.approx(single, abs=1e-3)


def test_interval_leaves_out_each_run():
    """Runs left out and evaluated again, one by one; Student's interval on the scale of log odds."""
    frames = runs_of(7, frames=3)
    names = sorted({told.run for told in frames})
    left_out = scipy.special.logit([average_precision([told for told in frames if told.run != name]) for name in names])
    spread = math.sqrt(6 / 7 * ((left_out - left_out.mean()) ** 2).sum())
    theirs = scipy.special.expit(
        scipy.stats.t.interval(0.95, 6, scipy.special.logit(average_precision(frames)), spread)
    )
    assert average_precision_interval(evaluate(frames, AT_07)) == pytest.approx(tuple(theirs), abs=1e-9)


@pytest.mark.parametrize("runs", [4, 8])
@pytest.mark.parametrize(("mean", "spread"), [(0.7, 0.08), (0.95, 0.035), (0.1, 0.08)])
def test_interval_holds_the_true_value_nineteen_times_of_twenty(mean, spread, runs):
    """Every run finds a share of its cars, drawn from a beta distribution, and nothing else: the AP is the mean share.

    Over 4,000 trials each the interval held it in 94.7, 95.2, 94.4, 94.3, 93.9 and 93.9 % of the six cases; percentiles
    of a bootstrap over the same runs in 77 to 89 %.
    """
    rng = np.random.default_rng([int(1000 * mean), runs])
    weight = mean * (1 - mean) / spread**2 - 1
    held, trials = 0, 1500
    for _ in range(trials):
        cars = rng.integers(100, 400, runs)
        found = rng.binomial(cars, rng.beta(mean * weight, (1 - mean) * weight, runs))
        low, high = average_precision_interval(found_of(cars, found))
        held += low <= mean <= high
    assert held / trials == pytest.approx(0.945, abs=0.02)


def found_of(cars, found):
    """Runs of a frame each, with so many cars of which so many are found, by equally good detections."""
    hits, run = int(found.sum()), np.arange(len(cars))
    nothing, no_points = np.zeros(hits), np.zeros(hits, dtype=np.int64)
    detections = EvaluatedDetections(
        np.full(hits, 0.5), np.ones(hits, dtype=bool), np.repeat(run, found), nothing, no_points, nothing
    )
    every, count = np.repeat(run, cars), int(cars.sum())
    wanted = CountedTruth(
        np.zeros(count), every, np.full(count, "car"), np.zeros(count, dtype=np.int64), np.ones(count), np.zeros(count)
    )
    return Evaluation(AT_07, detections, wanted, run)


def test_interval_stays_between_nought_and_one():
    cars = np.full(4, 10)
    for found in ([10, 10, 10, 9], [0, 0, 1, 0], [10, 0, 10, 0], [10, 10, 10, 10], [0, 0, 0, 0]):
        evaluation = found_of(cars, np.array(found))
        low, high = average_precision_interval(evaluation)
        assert 0.0 <= low <= evaluation.average_precision <= high <= 1.0


def test_too_few_runs_give_no_interval_and_a_sentence():
    few = evaluate(runs_of(3, frames=20), AT_07)
    assert average_precision_interval(few) is None
    assert too_few_runs(3).startswith("3 test runs of traffic give no interval over traffic")
    assert "test on 4 or more, better 8" in too_few_runs(1)
    assert not too_few_runs(4)
    cars = np.array([10, 10, 10, 0, 0, 0])  # runs without any show nothing of how runs differ
    assert average_precision_interval(found_of(cars, cars)) is None


def test_vehicles_are_what_the_study_compares():
    assert Rule(iou=0.7, in_space=False, categories=VEHICLES, fewest_points=0) == AT_07
