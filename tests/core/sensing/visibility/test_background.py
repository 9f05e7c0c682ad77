"""Work in a thread that nobody waits for, and visibility that stops soon."""

import time
from dataclasses import replace

import pytest

from seip_addon.background import Background
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Pace, Progress, finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY

SITE = junction_site(positions=80, heights=[4.0, 6.0, 8.0], spacing=1.0)
MODELS = load_catalogue()


def counting(number):
    for done in range(number):
        yield Progress(done, number, "count")
        time.sleep(0.001)
    return number


def test_the_result_comes_back():
    work = Background(counting(5))
    assert work.result() == 5
    assert work.ended


def test_an_error_comes_back():
    def failing():
        yield Progress(0, 1, "fail")
        raise SeipError("no")

    work = Background(failing())
    with pytest.raises(SeipError, match="no"):
        work.result()


def test_the_pace_tells_how_long_it_takes_still():
    pace = Pace()
    pace.note(Progress(0, 0, "set up"), 0.0)
    assert pace.seconds_left is None
    pace.note(Progress(10, 100, "rays"), 50.0)
    assert pace.seconds_left is None
    pace.note(Progress(40, 100, "rays"), 56.0)
    assert pace.seconds_left == pytest.approx(12.0)


@pytest.mark.parametrize("step", [Progress(41, 0, "rays"), Progress(41, 100, "rays", counted=False)])
def test_no_time_is_left_of_a_search_or_of_stages(step):
    pace = Pace()
    for number, done in enumerate((0, 20, 40)):
        pace.note(replace(step, done=done), float(number))
        assert pace.seconds_left is None
    pace.note(step, 3.0)
    assert pace.seconds_left is None


def test_work_that_begins_again_has_a_pace_of_its_own():
    pace = Pace()
    for now, done in ((0.0, 0), (1.0, 100), (2.0, 0), (12.0, 10)):
        pace.note(Progress(done, 100, "rays"), now)
    assert pace.seconds_left == pytest.approx(90.0)


@pytest.mark.parametrize("engine", ["bvh", "auto"])
def test_stopped_visibility_ends_soon(engine):
    if engine == "bvh":
        pytest.importorskip("bpy")
    work = Background(compute_visibility(SITE, MODELS, VisibilitySettings(), engine))
    while not work.progress.total:
        time.sleep(0.01)
    time.sleep(0.2)
    work.stop()
    began = time.perf_counter()
    assert work.join(5.0)
    assert time.perf_counter() - began < 0.5


@pytest.mark.slow
def test_one_thread_finds_the_same():
    site = junction_site(positions=20, heights=[4.0], spacing=2.0)
    grids = [finish(compute_visibility(site, MODELS, VisibilitySettings(), ANY, threads=n)) for n in (None, 1)]
    assert (grids[0].packed == grids[1].packed).all()
