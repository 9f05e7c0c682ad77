"""Catalogue, beam patterns and the disturbance of returns."""

import math
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.noisy_returns import measured_returns, return_chance
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from tests.builders.traffic_by_hand import make_model
from tests.oracles.full_scan import beam_directions

CATALOGUE = load_catalogue()

GOOD = {
    "name": '"Mine"',
    "manufacturer": '"Me"',
    "source": '"My datasheet"',
    "channels": "4",
    "field_of_view_deg": "[-10.0, 2.0]",
    "range_m": "[0.5, 50.0]",
    "points_per_second": "40_000",
    "rotation_rate_hz": "10",
    "price_usd": "[1000, 3000]",
}


def write_model(path, **changes):
    entries = {key: value for key, value in (GOOD | changes).items() if value is not None}
    path.write_text("[mine]\n" + "".join(f"{key} = {value}\n" for key, value in entries.items()), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("key", "channels", "low", "high", "reach", "points", "price"),
    [
        ("type1", 16, -15, 15, 100, 300e3, (4e3, 8e3)),
        ("type2", 32, -25, 15, 200, 1.2e6, (10e3, 20e3)),
        ("type3", 128, -25, 15, 300, 4.8e6, (70e3, 90e3)),
    ],
)
def test_the_studys_types_have_the_studys_figures(key, channels, low, high, reach, points, price):
    model = CATALOGUE[key]
    assert (model.channels, model.max_range, model.price_range) == (channels, reach, price)
    assert np.degrees([model.elevations.min(), model.elevations.max()]) == pytest.approx([low, high])
    assert model.channels * model.azimuth_count * 5 == points
    assert model.rotation_rate == 5
    assert model.range_noise_std == 0.03
    assert model.price == sum(price) / 2


def test_the_catalogue_holds_real_sensors_with_uneven_tables():
    real = [model for model in CATALOGUE.values() if model.manufacturer != "generic"]
    assert len(real) >= 6
    gaps = {model.key: np.diff(np.sort(model.elevations)) for model in real}
    assert {key for key, gap in gaps.items() if gap.max() > 2 * gap.min()} >= {"vlp32c", "vls128", "pandar64"}
    assert all(len(np.unique(model.elevations)) == model.channels and model.source for model in real)


@pytest.mark.parametrize("key", ["type1", "vls128"])
def test_directions_are_unit_vectors_at_the_published_angles(key):
    model = CATALOGUE[key]
    yaw = 0.3
    rays = beam_directions(model, yaw)
    assert rays.shape == (model.channels, model.azimuth_count, 3)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=2), 1, atol=1e-15)
    np.testing.assert_allclose(np.arcsin(rays[:, 0, 2]), model.elevations, atol=1e-14)
    step = 2 * math.pi / model.azimuth_count
    azimuth = np.arctan2(rays[:, :, 1], rays[:, :, 0])
    expected = yaw + model.azimuth_offsets[:, None] + step * np.arange(model.azimuth_count)
    np.testing.assert_allclose(np.exp(1j * azimuth), np.exp(1j * expected), atol=1e-13)


@pytest.mark.parametrize("degrees", [1, 120, 180, 359])
def test_columns_of_a_limited_field_of_view_lie_evenly_and_symmetrically_about_azimuth_zero(tmp_path, degrees):
    model = load_catalogue([write_model(tmp_path / "mine.toml", horizontal_field_of_view_deg=str(degrees))])["mine"]
    rays = beam_directions(model, 0.3)
    azimuth = np.degrees(np.arctan2(rays[0, :, 1], rays[0, :, 0]) - 0.3)
    step = degrees / 1000
    expected = [-degrees / 2 + (column + 0.5) * step for column in range(1000)]
    assert (azimuth + 180) % 360 - 180 == pytest.approx(expected, abs=1e-9)
    assert math.degrees(model.azimuth_step) == pytest.approx(step)
    assert not model.all_round


def test_a_file_of_the_users_adds_and_replaces(tmp_path):
    catalogue = load_catalogue([write_model(tmp_path / "mine.toml")])
    assert list(catalogue) == [*CATALOGUE, "mine"]
    mine = catalogue["mine"]
    assert np.degrees(mine.elevations) == pytest.approx([2, -2, -6, -10])
    assert (mine.azimuth_count, mine.min_range, mine.price) == (1000, 0.5, 2000)
    (tmp_path / "own.toml").write_text((tmp_path / "mine.toml").read_text().replace("[mine]", "[type1]"))
    assert load_catalogue([tmp_path / "own.toml"])["type1"].name == "Mine"


def test_a_law_follows_from_published_ranges_or_is_assumed_and_said_to_be(tmp_path):
    def law_of(**changes):
        mine = load_catalogue([write_model(tmp_path / "mine.toml", **changes)])["mine"]
        return mine.law, mine.assumed

    published = law_of(detection_range_m="[20.0, 50.0]", detection_probability="0.8")
    assert published == (RangeEquation.of_ranges(20.0, 50.0, 0.8), "")
    assert law_of(detection_law="[-11.0, 1.1, 0.99]") == (RangeEquation(-11.0, 1.1, 0.99), "")
    law, assumed = law_of()
    assert assumed.startswith("its longest range, 50 m, is taken to be the range at 10 % reflectivity")
    assert isinstance(law, RangeEquation)
    assert law.reach(0.1, 0.9) == pytest.approx(50.0)
    assert law_of(dropoff_general_rate="0.1") == (CarlaDropoff(general=0.1), "")  # as before there was another law


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"channels": None}, "channels is missing"),
        ({"chanels": "4"}, "chanels"),
        ({"channels": "true"}, "channels"),
        ({"field_of_view_deg": "[2.0, -10.0]"}, "increasing"),
        ({"field_of_view_deg": "[-90.0, 2.0]"}, "an elevation is -90, not -89.999 to 89.999 degrees"),
        ({"channels": None, "field_of_view_deg": None, "elevations_deg": "[]"}, "channel"),
        ({"channels": None, "field_of_view_deg": None, "elevations_deg": '["up"]'}, "numbers"),
        ({"elevations_deg": "[1.0]"}, "channels, field_of_view_deg"),
        ({"azimuth_offsets_deg": "[1.0]"}, "offset"),
        ({"horizontal_field_of_view_deg": "360.1"}, "the horizontal field of view is .*, not 0.001 to 360 degrees"),
        ({"horizontal_field_of_view_deg": "[-60.0, 60.0]"}, "horizontal_field_of_view_deg must be a number"),
        ({"clockwise": '"yes"'}, "clockwise must be true or false"),
        ({"range_m": "[50.0, 50.0]"}, "range"),
        ({"range_m": "[0.0, inf]"}, "range"),
        ({"points_per_second": "0"}, "points per second"),
        ({"rotation_rate_hz": "-5"}, "rotation"),
        ({"price_usd": "[3000, 1000]"}, "price"),
        ({"price_usd": "[1000, 2e9]"}, r"its price is 2e\+09, not 0 to 1e\+09 USD"),
        ({"attenuation_per_m": "nan"}, "attenuation"),
        ({"dropoff_general_rate": "1.5"}, "drop-off"),
        ({"model": '"optics"'}, "model must be one of 'range equation', 'carla', not 'optics'"),
        ({"model": '"carla"', "detection_range_m": "[9.0, 20.0]"}, 'not a figure of the model "carla"'),
        ({"detection_range_m": "[20.0, 9.0]"}, "the range at 80 % reflectivity"),
        ({"detection_probability": "0.999"}, "a probability of detection"),
        ({"detection_range_m": "[9.0, 8.0, 7.0]"}, "the range at 10 % reflectivity, and that at 80 %"),
        ({"detection_law": "[-11.0, 0.9]"}, "3 numbers"),
        ({"detection_law": "[-11.0, 0.9, 1.1]"}, "the ceiling of detection"),
        ({"detection_law": "[-11.0, 0.9, 0.9]", "detection_probability": "0.5"}, "either detection_law"),
        ({"range_noise_growth_per_m": "-1"}, "growth of the range noise"),
        ({"range_noise_std_m": "1e300"}, r"the range noise is 1e\+300, not 0 to 10 m"),
        ({"azimuth_offsets_deg": "[1e9, 0.0, 0.0, 0.0]"}, r"an azimuth offset is 1e\+09, not -720 to 720 degrees"),
        ({"detection_range_m": "[150.0, 150.2]"}, "must be 1.3 times the one at 10 %"),
        ({"detection_law": "[800.0, 0.9, 0.9]"}, r"the threshold of detection is 800, not -60 to 20 \(ln of 1/m²\)"),
        ({"detection_law": "[-12.0, 0.001, 0.95]"}, r"the spread of detection is 0.001, not 0.05 to 10"),
    ],
)
def test_each_fault_of_a_model_has_its_sentence(tmp_path, changes, words):
    path = write_model(tmp_path / "mine.toml", **changes)
    with pytest.raises(SeipError, match=words) as caught:
        load_catalogue([path])
    assert "'mine'" in str(caught.value)
    assert "mine.toml" in str(caught.value)


def test_files_that_are_no_catalogue(tmp_path):
    with pytest.raises(SeipError, match="cannot read"):
        load_catalogue([tmp_path / "absent.toml"])
    (tmp_path / "bad.toml").write_text("[mine")
    with pytest.raises(SeipError, match="not valid TOML"):
        load_catalogue([tmp_path / "bad.toml"])
    (tmp_path / "flat.toml").write_text("mine = 1")
    with pytest.raises(SeipError, match="is not a table"):
        load_catalogue([tmp_path / "flat.toml"])
    (tmp_path / "empty.toml").touch()
    with pytest.raises(SeipError, match="has no sensor"):
        load_catalogue([tmp_path / "empty.toml"])


def test_intensity_falls_with_range_and_incidence():
    law = CATALOGUE["type1"].law
    intensity = law.intensity(np.array([0.0, 100.0, 50.0]), np.array([1.0, 1.0, 0.5]))
    np.testing.assert_allclose(intensity, [1, math.exp(-0.4), 0.5 * math.exp(-0.2)])


def sensor(**changes):
    return make_model(
        **{"elevations": np.array([0.0, -0.1]), "min_range": 1.0, "points_per_second": 2000.0, "law": CarlaDropoff()}
        | changes
    )


def test_noise_and_drop_off_have_their_rates():
    law = CarlaDropoff(attenuation=0.0, general=0.25, zero_intensity=0.4, intensity_limit=0.8)
    model = sensor(law=law, range_noise_std=0.05)
    count = 200_000
    intensity = np.repeat([0.9, 0.4, 0.0], count)
    distance = np.full(3 * count, 50.0)
    chance = return_chance(model, distance, intensity)
    ray, measured = measured_returns(model, distance, chance, np.random.default_rng(1))
    kept = np.bincount(ray // count) / count
    np.testing.assert_allclose(kept, 0.75 * np.array([1.0, 0.8, 0.6]), atol=0.005)
    noise = measured - 50
    assert abs(noise.mean()) < 1e-3
    assert noise.std() == pytest.approx(0.05, rel=0.02)


def test_measured_returns_follow_the_seed_and_leave_misses():
    model = sensor()

    def returns(*distance):
        far = np.array(distance)
        ray, measured = measured_returns(model, far, return_chance(model, far, np.ones(5)), np.random.default_rng(7))
        return ray.tolist(), measured

    first, again = (returns(np.inf, 0.5, 50.0, 101.0, 20.0) for _ in range(2))
    assert first[0] == again[0] == [2, 4]
    assert (first[1] == again[1]).all()
    rays, other = returns(9.0, 9.0, 50.0, 9.0, 20.0)
    assert rays == [0, 1, 2, 3, 4]
    assert (other[[2, 4]] == first[1]).all()


def test_the_documented_example_is_a_catalogue(tmp_path):
    text = (Path(__file__).resolve().parents[4] / "docs" / "sensors.md").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    assert load_catalogue([tmp_path / "mine.toml"])["corner32"].price == 9_000


def test_the_documentation_names_every_sensor():
    text = (Path(__file__).resolve().parents[4] / "docs" / "sensors.md").read_text(encoding="utf-8")
    assert all(f"| `{key}` |" in text for key in load_catalogue())


laws = st.builds(
    RangeEquation,
    threshold=st.floats(-16.0, -6.0),
    spread=st.floats(0.2, 2.0),
    ceiling=st.floats(0.8, 1.0),
    extinction=st.floats(0.0, 0.05),
)


@given(at_10=st.floats(1.0, 200.0), more=st.floats(1.3, 4.0), probability=st.floats(0.05, 0.95))
def test_ranges_of_the_data_sheet_come_out_again(at_10, more, probability):
    law = RangeEquation.of_ranges(at_10, at_10 * more, probability)
    assert law.reach(0.1, probability) == pytest.approx(at_10, rel=1e-9)
    if more <= math.sqrt(8.0):  # else the ranges contradict 1/r², and the shorter one counts
        assert law.reach(0.8, probability) == pytest.approx(at_10 * more, rel=1e-9)
    else:
        assert law.extinction == 0.0


@given(law=laws, distance=st.floats(0.1, 500.0), cos=st.floats(-1.0, 1.0), reflectivity=st.floats(0.001, 1.0))
def test_probability_is_the_formula(law, distance, cos, reflectivity):
    found = law.chance(np.array([distance]), np.array([abs(cos) * reflectivity]))[0]
    power = abs(cos) * reflectivity * math.exp(-2 * law.extinction * distance) / distance**2
    exact = 0.0 if power == 0.0 else NormalDist(law.threshold, law.spread).cdf(math.log(power)) * law.ceiling
    assert found == pytest.approx(exact, abs=2e-7)


def test_light_lost_in_air_shortens_the_range():
    clear = RangeEquation.of_ranges(40.0, 110.0)
    assert clear.in_air(0.01).reach(0.1, 0.9) < 30.0 < clear.reach(0.1, 0.9)


@pytest.mark.parametrize(
    ("at_10", "at_80"),
    [(0.0, 9.0), (9.0, 9.0), (9.0, 4.0), (9.0, 9.1), (math.nan, 1.0), (1.0, math.inf), (1e200, 1e250), (1e-9, 1.0)],
)
def test_ranges_that_contradict_each_other_are_refused(at_10, at_80):
    with pytest.raises(SeipError, match="the range at 80 % reflectivity"):
        RangeEquation.of_ranges(at_10, at_80)
