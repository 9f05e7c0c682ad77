"""Models beside measurements: known laws are found again, and each mistake has its sentence."""

import copy
import json
import math

from headless.studies.calibration.comparison import compare
from headless.studies.calibration.reference import load_reference
from headless.studies.calibration.share_fit import fit

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from tests.builders.measured_sensor import EDGES, LAW, measured, share


@pytest.fixture
def reference(tmp_path):
    def write(content):
        path = tmp_path / "reference.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return path

    return write


@pytest.fixture
def sensor(reference):
    return load_reference(reference(measured(LAW)))["mine"]


def test_the_law_of_the_measurement_is_found_again(sensor):
    fits = fit(sensor, LAW)
    assert fits.bins == 12
    assert fits.misfits == pytest.approx((0.0, 0.0, 0.0), abs=2e-3)
    assert (fits.free.threshold, fits.free.spread, fits.free.ceiling) == pytest.approx((-11.6, 0.7, 0.96), abs=0.02)
    assert fits.determined


def test_a_gain_is_found_again_and_leaves_the_rest(sensor):
    fits = fit(sensor, RangeEquation(-9.0, 0.7, 0.96))
    assert fits.misfits[0] > 0.2
    assert (fits.gain.threshold, fits.gain.spread, fits.gain.ceiling) == (pytest.approx(-11.6, abs=0.02), 0.7, 0.96)
    shares = [share(low, low + 10, RangeEquation(-9.0, 0.7, 0.96), 0.17) for low in EDGES[:6]]
    shares += [share(low, low + 10, RangeEquation(-9.0, 0.7, 0.96), 0.3, 0.8) for low in EDGES[:6]]
    bins = [*sensor.ground_by_range_m[:6], *sensor.vertical_by_range_m[:6]]
    rest = [one - each.share for one, each in zip(shares, bins, strict=True)]
    assert fits.misfits[0] == pytest.approx(math.sqrt(np.mean(np.square(rest))), abs=2e-3)


def test_bins_of_few_rays_or_far_away_are_not_fitted(reference):
    content = measured(LAW)
    for name in ("ground_by_range_m", "vertical_by_range_m"):
        for one in content["sensors"]["mine"][name]:
            one["rays"] = 199
            one["share"] = 0.5
    few = load_reference(reference(content))["mine"]
    assert fit(few, LAW) is None
    assert compare("mine", few, load_catalogue()["vls128"]).fits is None


def test_shares_that_never_fall_determine_no_threshold(reference):
    content = measured(LAW)
    for name in ("ground_by_range_m", "vertical_by_range_m"):
        for one in content["sensors"]["mine"][name]:
            one["share"] = 0.98
    fits = fit(load_reference(reference(content))["mine"], LAW)
    assert not fits.determined
    assert fits.free.ceiling == pytest.approx(0.98, abs=1e-3)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_beams_are_compared_whatever_their_order_rotation_and_sense(reference, sense):
    content = measured(LAW)
    model = load_catalogue()["vls128"]
    order = np.random.default_rng(1).permutation(model.channels)
    elevation, offset = np.degrees(model.elevations)[order], np.degrees(model.azimuth_offsets)[order]
    elevation[3] += 0.02
    beams = {"elevation_deg": elevation.tolist(), "azimuth_offset_deg": (sense * offset + 170.0).tolist()}
    content["sensors"]["mine"]["beams"] = beams | {"azimuth_step_deg": 0.2}
    found = compare("mine", load_reference(reference(content))["mine"], model).beams
    assert found.elevation_largest == pytest.approx(0.02, abs=1e-6)
    assert found.elevation_rms == pytest.approx(0.02 / math.sqrt(model.channels), abs=1e-6)
    assert (found.azimuth_largest, found.azimuth_rms) == (pytest.approx(0.0, abs=1e-4),) * 2


def test_noise_is_set_against_the_measured_one(sensor):
    model = load_catalogue()["vls128"]
    (ratio,) = compare("mine", sensor, model).ground_noise
    assert ratio.ratio == pytest.approx(model.range_noise(np.array([15.0]))[0] / 0.01)


def test_models_without_the_range_equation_are_refused(sensor):
    with pytest.raises(SeipError, match="the drop-off of CARLA"):
        compare("mine", sensor, load_catalogue()["type1"])


def setting(value, *path):
    def change(content):
        *way, last = path
        for step in way:
            content = content[step]
        content[last] = value

    return change


MINE = ("sensors", "mine")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (setting(2, "version"), "version"),
        (setting({}, "sensors"), "sensors"),
        (setting(7, *MINE), "mine"),
        (setting("high", *MINE, "identity", "mounting_height_m"), "mounting_height_m"),
        (setting(1.2, *MINE, "ground_by_range_m", 0, "share"), "bin 0-10: share"),
        (setting("9-1", *MINE, "ground_by_range_m", 0, "bin"), "ascending"),
        (setting(0, *MINE, "range_noise_ground", 0, "robust_std_m"), "robust_std_m"),
        (setting([1.0], *MINE, "beams", "azimuth_offset_deg"), "azimuth_offset_deg|elevation_deg"),
    ],
)
def test_mistakes_are_named(reference, change, named):
    content = copy.deepcopy(measured(LAW))
    change(content)
    with pytest.raises(SeipError, match=named):
        load_reference(reference(content))


@pytest.mark.parametrize("content", ["", "[" * 100_000, "7"])
def test_other_files_are_refused(reference, content):
    with pytest.raises(SeipError, match=r"cannot read the measurements|all must be an object"):
        load_reference(reference(content))
