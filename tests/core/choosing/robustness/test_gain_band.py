"""Coverage over the plausible gains of sensors that no sweep calibrates."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.choosing.placement.deployment import GainBand, TypeBand
from seip_addon.core.choosing.robustness.gain_band import is_uncertain, with_gain_band
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from tests.builders.small_junction import make_example

CATALOGUE = load_catalogue()
KEYS = ("os1_64_gen1", "os1_128", "vlp16")


@pytest.fixture(scope="module")
def example():
    return make_example()


def deployed(example, key):
    """The example's sensors, all of one type of the catalogue, seeing what that type sees."""
    sensors = tuple(replace(sensor, model=CATALOGUE[key]) for sensor in example.deployment.sensors)
    seen = covered(example, sensors)
    return replace(example.deployment, sensors=sensors, coverage=float(seen.mean()))


def covered(example, sensors, gain=1.0):
    model = visibility_model(example.site, VisibilitySettings())
    return np.any([model.see(one.model.amplified(gain), one.xyz, one.orientation) for one in sensors], axis=0)


def around(example, *keys):
    return Surroundings(example.site, {key: CATALOGUE[key] for key in keys}, VisibilitySettings())


def test_every_sensor_says_what_its_detection_rests_on():
    for model in CATALOGUE.values():
        low, high = model.gains
        assert model.evidence
        if model.manufacturer == "generic" or model.calibration:
            assert (low, high) == (1.0, 1.0)
        else:
            assert low < 1.0 < high
            assert "data sheet" in model.evidence
    assert {key for key, model in CATALOGUE.items() if model.calibration} == {"hdl32e", "os1_128"}
    assert CATALOGUE["vlp16"].gains[1] > CATALOGUE["os0_128"].gains[1]  # only a longest range is published


def test_a_longest_range_is_not_the_range_at_80_percent():
    vlp16 = CATALOGUE["vlp16"]
    assert vlp16.law.reach(0.1, 0.9) == pytest.approx(100.0)
    assert "10 % reflectivity" in vlp16.assumed


def test_a_gain_is_power():
    law = CATALOGUE["os1_64_gen1"].law
    distance, reflected = np.array([5.0, 20.0, 60.0]), np.full(3, 0.1)
    assert law.amplified(4.0).chance(distance, reflected) == pytest.approx(law.chance(distance, 4 * reflected))
    assert CATALOGUE["type1"].amplified(4.0) is CATALOGUE["type1"]


def test_the_band_is_the_coverage_at_its_ends(example):
    plain = deployed(example, "os1_64_gen1")
    band = finish(with_gain_band(around(example, "os1_64_gen1"), plain)).gain_band
    low, high = (covered(example, plain.sensors, gain).mean() for gain in (0.3, 2.3))
    assert (band.low, band.high) == (pytest.approx(low), pytest.approx(high))
    assert band.low < plain.coverage < band.high
    assert (band.sheets, band.types) == (("os1_64_gen1",), ())
    assert f"{band.low:.1%} to {band.high:.1%}: detection by os1_64_gen1" in band.messages()[0]


def test_each_type_is_compared_where_the_sensors_are(example):
    plain = deployed(example, "os1_128")
    band = finish(with_gain_band(around(example, *KEYS), plain)).gain_band
    assert band.sheets == ()
    assert (band.low, band.high) == (plain.coverage, plain.coverage)
    for one in band.types:
        sensors = deployed(example, one.sensor).sensors
        for share, gain in zip((one.low, one.high), CATALOGUE[one.sensor].gains, strict=True):
            assert share == pytest.approx(covered(example, sensors, gain).mean())


def test_calibrated_types_and_the_study_s_have_no_band(example):
    for keys in (("os1_128", "hdl32e"), ("type1", "type2")):
        plain = deployed(example, keys[0])
        assert not any(is_uncertain(CATALOGUE[key]) for key in keys)
        assert finish(with_gain_band(around(example, *keys), plain)) is plain


def test_types_whose_bands_overlap_are_not_ranked():
    bands = (TypeBand("a", 0.2, 0.5), TypeBand("b", 0.5, 0.9), TypeBand("c", 0.95, 0.96))
    band = GainBand(0.2, 0.5, ("a",), bands)
    assert [(one.sensor, other.sensor) for one, other in band.unranked] == [("a", "b")]
    assert band.messages()[1].endswith("a 20.0% to 50.0%, b 50.0% to 90.0%")
    assert TypeBand("a", 0.4701, 0.4703).describe() == "47.0%"
    assert GainBand(0.2, 0.5, (), bands[::2]).messages() == ()
