"""Coverage over the plausible gains of sensors that no sweep calibrates."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.robustness.gain_band import with_gain_band
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model

CATALOGUE = load_catalogue()


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
            assert not model.assumed_law
        else:
            assert low < 1.0 < high
            assert "data sheet" in model.evidence
            assert bool(model.assumed_law) == (high > 2.3)
    assert {key for key, model in CATALOGUE.items() if model.calibration} == {"hdl32e", "os1_128"}
    needed = {"hdl64e": 39.0, "os2_128": 0.09, "ruby_plus": 0.19, "os0_128": 2.3}  # by sweeps
    for key, gain in needed.items():
        low, high = CATALOGUE[key].gains
        assert low <= gain <= high


def test_the_band_is_the_coverage_at_its_ends(example):
    plain = deployed(example, "os1_64_gen1")
    band = finish(with_gain_band(around(example, "os1_64_gen1"), plain)).gain_band
    low, high = (covered(example, plain.sensors, gain).mean() for gain in (0.09, 39.0))
    assert (band.low, band.high) == (pytest.approx(low), pytest.approx(high))
    assert band.low < plain.coverage < band.high
    assert (band.sheets, band.types) == (("os1_64_gen1",), ())
    assert f"{band.low:.1%} to {band.high:.1%}: detection by os1_64_gen1" in band.messages()[0]
