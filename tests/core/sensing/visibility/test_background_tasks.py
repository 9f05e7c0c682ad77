"""Work in a thread that nobody waits for, and visibility that stops soon."""

import time

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Pace, Progress
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.panel.session import RunningWork
from tests.builders.synthetic_junction import junction_site

SITE = junction_site(positions=80, heights=[4.0, 6.0, 8.0], spacing=1.0)
MODELS = load_catalogue()


def counting(number):
    for done in range(number):
        yield Progress(done, number, "count")
        time.sleep(0.001)
    return number


def test_the_result_comes_back():
    work = RunningWork("", counting(5))
    assert work.result() == 5
    assert work.ended


def test_an_error_comes_back():
    def failing():
        yield Progress(0, 1, "fail")
        raise SeipError("no")

    work = RunningWork("", failing())
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


@pytest.mark.parametrize("engine", ["bvh", "auto"])
def test_stopped_visibility_ends_soon(engine):
    if engine == "bvh":
        pytest.importorskip("bpy")
    work = RunningWork("", compute_visibility(SITE, MODELS, VisibilitySettings(), engine))
    while not work.progress.total:
        time.sleep(0.01)
    time.sleep(0.2)
    work.stop()
    began = time.perf_counter()
    assert work.join(5.0)
    assert time.perf_counter() - began < 0.5
