"""Rosettes of two prisms against refraction in the plane, against vectors that add up, and against the data sheets."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.lidar.rosette import Rosette
from tests.oracles.visibility_search import behind_prisms

CATALOGUE = load_catalogue()

GOOD = {
    "name": '"Mine"',
    "manufacturer": '"Me"',
    "source": '"My datasheet"',
    "pattern": '"rosette"',
    "prism_rates_rpm": "[6000.0, -4500.0]",
    "prism_wedges_deg": "[18.0, 18.0]",
    "refractive_index": "1.5095",
    "horizontal_field_of_view_deg": "38.4",
    "range_m": "[0.5, 50.0]",
    "points_per_second": "40_000",
    "price_usd": "[1000, 3000]",
}


def write_model(path: Path, **changes: str | None) -> Path:
    entries = {key: value for key, value in (GOOD | changes).items() if value is not None}
    path.write_text("[mine]\n" + "".join(f"{key} = {value}\n" for key, value in entries.items()), encoding="utf-8")
    return path


def off_axis(rays: np.ndarray) -> np.ndarray:
    return np.arctan2(np.hypot(rays[:, 1], rays[:, 2]), rays[:, 0])


def all_rays(model: LidarModel) -> np.ndarray:
    return BeamPattern(model).directions(np.arange(model.channels))


def in_the_plane(first: float, second: float, index: float) -> float:
    """Angle off the axis behind oblique faces with their normals at angles in one plane, by angles alone."""
    after_first = math.asin(index * math.sin(-first)) + first
    inside = math.asin(math.sin(after_first - second) / index) + second
    return math.asin(index * math.sin(inside))


@pytest.mark.parametrize(("one", "other", "index"), [(18.0, 18.0, 1.5095), (12.0, 7.0, 1.7), (3.0, 25.0, 1.3)])
def test_the_beam_in_one_plane_is_that_of_refraction_angle_by_angle(one: float, other: float, index: float) -> None:
    first, second = math.radians(one), math.radians(other)
    rosette = Rosette((1.0, -2.0), (first, second), index)
    # after a sixth of a second the first prism is a sixth of a turn on, the second a third back: half a turn apart
    rays = rosette.directions(np.array([0.0, 1 / 6]))
    along = math.radians(60)
    together, apart = -in_the_plane(-first, second, index), -in_the_plane(-first, -second, index)
    expected = [(math.cos(together), abs(math.sin(together)), 0.0)]
    side = abs(math.sin(apart)) * math.copysign(1.0, first - second if first != second else 1.0)
    expected.append((math.cos(apart), side * math.cos(along), side * math.sin(along)))
    np.testing.assert_allclose(rays, expected, atol=1e-12)
    assert rosette.reach == pytest.approx(abs(together), abs=1e-14)


@given(st.integers(0, 2**32 - 1))
def test_any_beam_is_that_of_faces_taken_one_by_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    rosette = Rosette(
        (random.uniform(1, 300), -random.uniform(1, 300)),
        (random.uniform(0.01, 0.4), random.uniform(0.01, 0.4)),
        random.uniform(1.1, 1.8),
        random.uniform(0, 1000),
    )
    rays = rosette.directions(np.arange(40) / 1000.0)
    np.testing.assert_allclose(rays, behind_prisms(rosette, 1000.0, 25.0), atol=1e-9)
    assert off_axis(rays).max() <= rosette.reach + 1e-12


@pytest.mark.parametrize(("key", "degrees", "points"), [("mid40", 38.4, 100e3), ("mid70", 70.4, 100e3)])
def test_shipped_rosettes_fill_the_circle_of_the_data_sheet(key: str, degrees: float, points: float) -> None:
    model = replace(CATALOGUE[key], rotation_rate=1.0)
    off = np.degrees(off_axis(all_rays(model)))
    assert off.max() == pytest.approx(degrees / 2, abs=0.02)
    assert off.min() < 0.02
    assert math.degrees(model.field_of_view) == pytest.approx(degrees, abs=0.03)
    assert model.points_per_second == points
    assert CATALOGUE[key].channels == points / 10


def test_frames_go_on_where_the_one_before_ended() -> None:
    model = CATALOGUE["mid40"]
    whole = all_rays(replace(model, rotation_rate=1.0))
    frames = [all_rays(model.at(number / 10)) for number in range(10)]
    np.testing.assert_allclose(np.concatenate(frames), whole, atol=1e-11)
    assert frames[0].tobytes() == all_rays(model).tobytes() == all_rays(model.at(0.0)).tobytes()
    assert all(np.abs(frame - frames[0]).max() > 0.1 for frame in frames[1:])
    assert model.at(0.3).at(0.4).rosette == model.at(0.7).rosette
    assert CATALOGUE["type1"].at(3.0) is CATALOGUE["type1"]


def test_rays_go_out_one_after_the_other() -> None:
    model = CATALOGUE["mid40"]
    assert model.delay(np.array([0, 1, 9_999])) == pytest.approx([0.0, 1e-5, 0.09999])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pattern": '"spiral"'}, "pattern must be 'rosette', or left out where there are channels, not 'spiral'"),
        ({"pattern": "true"}, "pattern must be 'rosette'"),
        ({"prism_rates_rpm": None}, "prism_rates_rpm is missing"),
        ({"prism_rates_rpm": "[6000.0]"}, "prism_rates_rpm must hold 2 numbers, not 1"),
        ({"prism_rates_rpm": "[6000.0, 0.0]"}, "the rate of a prism is 0, not 0.001 to 1,000 Hz"),
        ({"prism_rates_rpm": "[nan, 10.0]"}, "the rate of a prism is nan, not"),
        ({"prism_rates_rpm": "[1e9, 10.0]"}, "the rate of a prism is 1.66667e"),
        ({"prism_rates_rpm": "[900.0, 900.0]"}, "at the same rate draw a circle: their rates must differ"),
        ({"prism_rates_rpm": "[900.0, -900.0]"}, "at opposite rates draw a line: their rates must differ"),
        ({"prism_wedges_deg": "[0.0, 18.0]"}, "the wedge angle of a prism is 0, not 0.001 to 45 degrees"),
        ({"prism_wedges_deg": "[18.0, 46.0]"}, "the wedge angle of a prism is 46, not 0.001 to 45 degrees"),
        ({"prism_wedges_deg": '["steep", 18.0]'}, "prism_wedges_deg must be a list of numbers"),
        ({"refractive_index": "1.0"}, "the refractive index is 1, not 1.001 to 4"),
        ({"refractive_index": "inf"}, "refractive_index"),
        ({"refractive_index": "3.9"}, "let no light through: take smaller angles"),
        ({"horizontal_field_of_view_deg": None}, "horizontal_field_of_view_deg is missing"),
        (
            {"horizontal_field_of_view_deg": "30.0"},
            "draw a circle of 38.4 degrees, but horizontal_field_of_view_deg is 30",
        ),
        ({"horizontal_field_of_view_deg": "360.0"}, "draw a circle of 38.4 degrees"),
        ({"horizontal_field_of_view_deg": "nan"}, "draw a circle of 38.4 degrees"),
        ({"accumulation_s": "0.0"}, "accumulation_s must be 0.001 to 100 s, not 0"),
        ({"accumulation_s": "-0.1"}, "accumulation_s must be 0.001 to 100 s, not -0.1"),
        ({"accumulation_s": "nan"}, "accumulation_s must be a number from 0.001 to 100 s"),
        ({"accumulation_s": '"long"'}, "accumulation_s must be a number"),
        ({"accumulation_s": "60.0"}, "accumulated over 2 to 2,000,000 points: with 40000 points per second"),
        ({"points_per_second": "10"}, "accumulated over 2 to 2,000,000 points"),
        ({"points_per_second": "1e300"}, "accumulated over 2 to 2,000,000 points"),
        ({"points_per_second": "0"}, "accumulated over 2 to 2,000,000 points"),
        (
            {"rotation_rate_hz": "10.0"},
            "rotation_rate_hz is not a figure of a rosette: leave it out, or leave out pattern",
        ),
        ({"channels": "4"}, "channels is not a figure of a rosette"),
        ({"elevations_deg": "[1.0, 2.0]"}, "elevations_deg is not a figure of a rosette"),
        ({"clockwise": "true"}, "clockwise is not a figure of a rosette"),
        ({"pattern": None}, "channels is missing|rotation_rate_hz is missing"),
        ({"prism_rate_rpm": "[1.0, 2.0]"}, "unknown key 'prism_rate_rpm'; did you mean prism_rates_rpm"),
    ],
)
def test_each_fault_of_a_rosette_has_its_sentence(tmp_path: Path, changes: dict[str, str | None], words: str) -> None:
    path = write_model(tmp_path / "mine.toml", **changes)
    with pytest.raises(SeipError, match=words) as caught:
        load_catalogue([path])
    assert "mine.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
