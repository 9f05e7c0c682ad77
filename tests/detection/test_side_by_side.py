"""Work in steps: several pieces at the same time."""

import threading

from headless.detection.detector_evaluation import side_by_side

import pytest

from seip_addon.core.base.progress import Progress, finish


def counting(steps, name, seen=None):
    for done in range(steps):
        if seen is not None:
            seen.append(name)
        yield Progress(done, steps, name)
    return name


def endless(stopped):
    pause = threading.Event()
    try:
        while not pause.wait(0.001):
            yield Progress(0, 1, "endless")
    finally:
        stopped.set()


def test_results_come_in_the_order_of_the_works():
    works = [counting(30 - 10 * number, str(number)) for number in range(3)]
    assert finish(side_by_side(works, 2)) == ["0", "1", "2"]


def test_a_work_that_fails_stops_the_others():
    stopped = threading.Event()

    def failing():
        yield Progress(0, 1, "fail")
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        finish(side_by_side([endless(stopped), failing()], 2))
    assert stopped.wait(10)


def test_stopping_stops_all():
    stopped = [threading.Event(), threading.Event()]
    steps = side_by_side([endless(one) for one in stopped], 2)
    next(steps)
    steps.close()
    assert all(one.wait(10) for one in stopped)
