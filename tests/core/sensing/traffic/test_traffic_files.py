"""Floating car data and vehicle types, by hand."""

import gzip
import math
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.floating_car_data import Extent, read_floating_car_data
from seip_addon.core.sensing.traffic.source import read_net_offset
from seip_addon.core.sensing.traffic.trajectories import SAMPLED, Trajectories
from seip_addon.core.sensing.traffic.vehicle_types import BUILT_IN, CAR, VehicleType, read_vehicle_types
from tests.builders.sumo_text import FCD, NET, ROUTES
from tests.builders.traffic_by_hand import make_trajectories


def written(folder, name, text):
    path = folder / name
    path.write_bytes(gzip.compress(text.encode()) if name.endswith(".gz") else text.encode())
    return path


def read(path, types=BUILT_IN, origin=(0.0, 0.0, 0.0), **more):
    found = finish(read_floating_car_data(path, types, np.array(origin), path.name, **more))
    return found.trajectories, found.warnings


def one(row, times=(0.0, 0.1)):
    steps = "".join(f'<timestep time="{time}">{row}</timestep>' for time in times)
    return f"<fcd-export>{steps}</fcd-export>"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("f.xml", FCD),
        ("f.fcd.xml.gz", FCD),
        ("f", FCD),
    ],
)
def test_every_form_says_the_same(tmp_path, name, text):
    data, _ = read(written(tmp_path, name, text), net_offset=np.array([10.0, 20.0]))
    assert [(user.name, user.category) for user in data.users] == [("a", "car"), ("w", "pedestrian"), ("b", "car")]
    assert data.first.tolist() == [0, 2, 3, 5]
    assert data.time.tolist() == [0.0, 0.2, 0.0, 0.2, 0.4]
    ahead = np.array([2.5, 2.5, 0, 2.5, 2.5])[:, None] * np.column_stack([np.cos(data.yaw), np.sin(data.yaw)])
    bumper = [[100, 30], [102, 30], [10, 10], [0, 0], [0, 1]]
    np.testing.assert_allclose(data.position[:, :2] + ahead, bumper, atol=1e-12)
    np.testing.assert_array_equal(data.position[:, 2], [1.5, 1.5, np.nan, 0, 0])
    np.testing.assert_allclose(np.degrees(data.yaw), [0, 0, 90, -260, -280], atol=1e-12)
    assert data.speed.tolist() == [10, 10, 1.3, 5, 5]


def test_riders_and_containers_are_left_out(tmp_path):
    """A bus with a passenger and a lorry with a container: the passenger stands in the bus, wherever it is."""
    steps = "".join(
        f'<timestep time="{k}"><vehicle id="bus" x="{9 * k}.50" y="3" angle="90" speed="9"/>'
        f'<person id="rider" x="{9 * k}.50" y="3" angle="90" speed="9"/><person id="walker" x="{k}" y="8" angle="90" '
        f'speed="1"/><container id="box" x="1" y="1" angle="0" speed="0"/></timestep>'
        for k in range(3)
    )
    data, warnings = read(written(tmp_path, "f.xml", f"<fcd-export>{steps}</fcd-export>"))
    assert [(user.name, user.category) for user in data.users] == [("bus", "car"), ("walker", "pedestrian")]
    assert data.position[:, 0].tolist() == [-2, 7, 16, 0, 1, 2]
    assert any("1 person in a vehicle" in one for one in warnings)


def test_the_middle_is_half_a_length_behind_the_bumper(tmp_path):
    types = finish(read_vehicle_types([written(tmp_path, "r.xml", ROUTES)]))
    got, warnings = read(written(tmp_path, "f.xml", FCD), types, (1.0, 2.0, 0.5))
    bus, walker, unknown = got.users
    assert (bus.category, bus.length, bus.width, bus.height) == ("bus", 10.0, 2.5, 3.0)
    assert walker.category == "pedestrian"
    assert (unknown.category, unknown.length) == ("car", 5.0)
    np.testing.assert_allclose(got.position[0], [110 - 5 - 1, 50 - 2, 1.0])
    np.testing.assert_allclose(got.position[2, :2], [19, 28])  # a walker's position is the middle
    angle = math.radians(100.0)  # b: 350 degrees clockwise from north
    np.testing.assert_allclose(got.position[3, :2], [10 - 2.5 * math.cos(angle) - 1, 20 - 2.5 * math.sin(angle) - 2])
    (sentence,) = warnings
    assert sentence.startswith("missing sizes: 1 of 3 road users is of no known vehicle type (b) and gets ")
    assert "5 × 1.8 × 1.5 m" in sentence


def test_types_fall_back_to_what_sumo_assumes(tmp_path):
    types = finish(read_vehicle_types([written(tmp_path, "r.xml.gz", ROUTES)]))
    assert types["default_truck"] == VehicleType("truck", 7.1, 2.4, 2.4)
    assert types["van_by_shape"] == VehicleType("van", 6.0, 1.8, 1.5)
    assert types["plain"] == CAR == types["DEFAULT_VEHTYPE"]
    assert types["DEFAULT_BIKETYPE"].category == "bicycle"


def test_only_the_window_is_kept(tmp_path):
    path = written(tmp_path, "f.xml", FCD)
    data, _ = read(path, window=Extent(begin=0.1, bounds=(0.0, 0.0, 50.0, 50.0)))
    assert [user.name for user in data.users] == ["b"]  # a is at 112 m; the walker was there before
    assert data.time.tolist() == [0.2, 0.4]


def test_the_offset_of_a_network(tmp_path):
    np.testing.assert_array_equal(read_net_offset(written(tmp_path, "n.net.xml", NET)), [270.79, -200.32])


ROW = '<vehicle id="a" x="1" y="2" angle="0"/>'
BOMB = '<!DOCTYPE f [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><fcd-export><timestep time="0"/>&b;</fcd-export>'


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("f.xml", one(ROW, (0.2, 0.1)), "times run backwards, 0.1 s comes after 0.2 s"),
        ("f.xml", one(ROW, (0.2, 0.2)), "'a' appears twice at 0.2 s"),
        ("f.xml", one(ROW.replace('x="1"', 'x="nan"')), "x='nan' of 'a' at 0 s is not a number"),
        ("f.xml", one(ROW.replace('angle="0"', "")), "angle='' of 'a' at 0 s is not a number"),
        ("f.xml", one(ROW, ("soon",)), "time='soon' of 'a time step' is not a number"),
        ("f.xml", "<routes/>", "not floating car data"),
        ("f.xml", FCD[:-30], "unfinished XML"),
        ("f.xml", "hello", "broken or unfinished XML"),
        ("f.xml", BOMB, "declares a document type"),
        ("f.xml", one(ROW.replace('x="1"', f'x="{50_000 * "1"}x"')), "111…' of 'a' at 0 s is not a number"),
        ("f.xml", one(ROW.replace('x="1"', 'x="1e300"')), "x='1e300' of 'a' at 0 s is beyond 1e+08"),
        ("f.xml", one(ROW, ("1e300",)), "time='1e300' of 'a time step' is beyond"),
        ("f.xml", FCD.replace("UTF-8", "klingon"), "encoding that cannot be read"),
        ("f.xml", FCD.replace("UTF-8", "utf-7"), "encoding that cannot be read"),
    ],
)
def test_a_wrong_file_gets_one_sentence(tmp_path, name, text, complaint):
    with pytest.raises(SeipError) as caught:
        read(written(tmp_path, name, text))
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300
    assert name in str(caught.value)


def test_damaged_or_missing_files_get_one_sentence(tmp_path):
    whole = gzip.compress(FCD.encode())
    (tmp_path / "f.xml.gz").write_bytes(whole[:-20])
    with pytest.raises(SeipError, match="damaged gzip"):
        read(tmp_path / "f.xml.gz")
    with pytest.raises(SeipError, match="no such file"):
        read(tmp_path / "none.xml")
    with pytest.raises(SeipError, match="cannot read"):
        read(tmp_path)


WAYS = ([(0.0, 1.0, 2.0, 0.0, 0.0, 0.0), (1.0, 5.0, 2.0, 0.0, 0.0, 0.0)], [(0.5, 9.0, 9.0, 0.0, 0.0, 0.0)])
RUN = make_trajectories(*WAYS)
CAR_1 = RUN.users[0]


@pytest.mark.parametrize(
    "changes",
    [
        *(
            {name: np.full_like(getattr(RUN, name), wrong)}
            for name in (*SAMPLED, "origin")
            for wrong in (np.nan, 1e300)
        ),
        {"time": RUN.time[:-1]},
        {"time": RUN.time[[1, 0, 2]]},
        {"position": RUN.position[:, :2]},
        {"first": np.array([0, 2])},
        {"first": np.array([0, 3, 3])},
        {"first": np.array([0, 4, 3])},
        {"first": np.array([1, 2, 3])},
        *({"users": (replace(CAR_1, **{name: 1e300}), CAR_1)} for name in ("length", "width", "height", "paint")),
        {"users": (replace(CAR_1, category="boat"), CAR_1)},
        {"users": (replace(CAR_1, name=7), CAR_1)},
        {"users": (replace(CAR_1, shape=(0.5, 0.5, 0.0, 0.0)), CAR_1)},
    ],
)
def test_trajectories_whose_numbers_are_wrong_are_refused(tmp_path, changes):
    RUN.save(tmp_path / "run.npz")
    assert Trajectories.load(tmp_path / "run.npz").key == RUN.key
    replace(RUN, **changes).save(tmp_path / "wrong.npz")
    with pytest.raises(SeipError, match="damaged or not a file of trajectories; import or simulate them again"):
        Trajectories.load(tmp_path / "wrong.npz")


def test_nobody_near_the_scene_is_refused(tmp_path):
    with pytest.raises(SeipError, match=r"FCD of another map.* none of the 3 road users in f.xml comes near"):
        read(written(tmp_path, "f.xml", FCD), window=Extent(bounds=(1e6, 1e6, 2e6, 2e6)))
