"""Connecting roads of netconvert's maps: whether they lead from the end of one road to the start of another."""

import math
import re

import numpy as np
import pytest

from seip_addon.core.world.opendrive.lanes import lane_surfaces
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.openstreetmap.connecting_roads import mended_text

LINE = '<geometry s="{s}" x="{x}" y="{y}" hdg="{hdg}" length="{length}"><line/></geometry>'


def lane(number, widths, *, before=None, after=None, kind="driving"):
    links = "".join(
        f'<{name} id="{link}"/>' for name, link in (("predecessor", before), ("successor", after)) if link is not None
    )
    start, slope = widths
    return (
        f'<lane id="{number}" type="{kind}" level="true"><link>{links}</link>'
        f'<width sOffset="0" a="{start}" b="{slope}" c="0" d="0"/></lane>'
    )


def road(number, plan, lanes, *, junction="-1", links="", length=20.0):
    return (
        f'<road name="" length="{length}" id="{number}" junction="{junction}"><link>{links}</link>'
        f"<planView>{plan}</planView>"
        '<elevationProfile><elevation s="0" a="5" b="0.1" c="0" d="0"/></elevationProfile>'
        '<lanes><laneSection s="0"><center><lane id="0" type="none" level="true"><link/></lane></center>'
        f"<right>{lanes}</right></laneSection></lanes></road>"
    )


def map_text(*roads):
    return f'<?xml version="1.0"?>\n<OpenDRIVE><header revMajor="1" revMinor="4"/>{"".join(roads)}</OpenDRIVE>'


def joined(before="1", after="2"):
    return (
        f'<predecessor elementType="road" elementId="{before}" contactPoint="end"/>'
        f'<successor elementType="road" elementId="{after}" contactPoint="start"/>'
    )


def quarter(first_plan, lanes="", length=20.0):
    """Return a road to the east, one to the north, and a straight connecting road from the first to the second."""
    east = road("1", first_plan, lane(-1, (3.2, 0)) + lane(-2, (2.5, 0), kind="sidewalk"), length=length)
    north = LINE.format(s=0, x=30, y=10, hdg=math.pi / 2, length=20)
    north = road("2", north, lane(-1, (3.2, 0)) + lane(-2, (2.5, 0), kind="sidewalk"))
    chord = LINE.format(s=0, x=20, y=0, hdg=math.pi / 4, length=math.sqrt(200))
    lanes = lanes or lane(-1, (3.2, 0), before=-1, after=-1)
    return map_text(east, north, road("3", chord, lanes, junction="7", links=joined(), length=math.sqrt(200)))


def read(text, tmp_path):
    path = tmp_path / "map.xodr"
    path.write_text(text, encoding="utf-8")
    return {one.id: one for one in read_map(path).roads}


EAST = LINE.format(s=0, x=0, y=0, hdg=0, length=20)


def test_a_chord_becomes_a_curve_between_the_roads(tmp_path):
    found = read(mended_text(quarter(EAST)), tmp_path)["3"]
    frame = found.frame(np.array([0.0, found.length / 2, found.length]))
    assert frame.heading == pytest.approx([0, math.pi / 4, math.pi / 2], abs=1e-3)
    on_circle = [20 + 10 * math.sin(math.pi / 4), 10 - 10 * math.cos(math.pi / 4)]
    assert frame.origin[:, :2] == pytest.approx(np.array([[20, 0], on_circle, [30, 10]]), abs=0.02)
    assert found.length == pytest.approx(10 * math.pi / 2, rel=1e-3)
    assert frame.origin[[0, -1], 2] == pytest.approx([5.0, 5.0 + 0.1 * math.sqrt(200)], abs=1e-3)


@pytest.mark.parametrize(
    "tail",
    [
        LINE.format(s=20, x=20, y=0, hdg=math.pi - 0.05, length=0.3),
        '<geometry s="20" x="20" y="0" hdg="0" length="3"><paramPoly3 aU="0" bU="3" cU="4" dU="-5" aV="0" bV="0" '
        'cV="0.3" dV="-0.3" pRange="normalized"/></geometry>' + LINE.format(s=23, x=22, y=0, hdg=-3.07, length=0.2),
    ],
    ids=["line", "curve"],
)
def test_a_road_that_turns_back_at_its_end_is_cut_there(tail, tmp_path):
    text = quarter(EAST + tail, length=20.3)
    found = read(mended_text(text), tmp_path)
    end = found["1"].frame(np.array([found["1"].length]))
    assert abs(end.heading[0]) < 0.1
    for surface in lane_surfaces(found["1"]):
        assert (np.diff(surface.left[:, 0]) > 0).all()
        assert (np.diff(surface.right[:, 0]) > 0).all()
    start = found["3"].frame(np.array([0.0]))
    assert start.origin[0, :2] == pytest.approx(end.origin[0, :2], abs=1e-6)
    assert start.heading[0] == pytest.approx(end.heading[0], abs=1e-6)


def test_of_two_lanes_that_lead_into_one_the_outer_tapers_to_nothing(tmp_path):
    lanes = (
        lane(-1, (3.2, 0), before=-1, after=-1)
        + lane(-2, (1.5, 0.11), before=-2, after=-1)
        + lane(-3, (2.5, 0), before=-3, after=-2, kind="sidewalk")
    )
    before = lane(-1, (3.2, 0)) + lane(-2, (1.5, 0), kind="biking") + lane(-3, (2.5, 0), kind="sidewalk")
    text = quarter(EAST, lanes).replace(lane(-1, (3.2, 0)) + lane(-2, (2.5, 0), kind="sidewalk"), before, 1)
    found = read(mended_text(text), tmp_path)
    last = {one.lane_id: one for one in lane_surfaces(found["3"])}
    next_lanes = {one.lane_id: one for one in lane_surfaces(found["2"])}
    widths = {number: np.hypot(*(one.left - one.right)[[0, -1], :2].T) for number, one in last.items()}
    assert widths[-2] == pytest.approx([1.5, 0.0], abs=1e-6)
    assert widths[-3] == pytest.approx([2.5, 2.5], abs=1e-6)
    assert last[-3].right[-1, :2] == pytest.approx(next_lanes[-2].right[0, :2], abs=0.01)


def test_a_connecting_road_that_fits_keeps_its_line(tmp_path):
    text = mended_text(quarter(EAST))
    assert re.findall(r"<planView>.*?</planView>", mended_text(text)) == re.findall(r"<planView>.*?</planView>", text)
