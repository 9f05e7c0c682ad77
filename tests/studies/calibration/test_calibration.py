"""Models beside measurements: known laws are found again, and each mistake has its sentence."""

import copy
import json
import math

from headless.studies.calibration import command as calibrate
from headless.studies.calibration.comparison import compare, pair
from headless.studies.calibration.fate import simulate_fates
from headless.studies.calibration.reference import load_reference
from headless.studies.calibration.share_fit import fit

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.lidar.surface_patches import surface_deviation
from tests.builders.measured_sensor import EDGES, ELEVATIONS, HEIGHT, LAW, OFFSETS, measured, share


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


def test_fates_correlate_as_drawn_ones_do(sensor):
    lags, steps, random = (1, 4), 720, np.random.default_rng(5)
    found = simulate_fates(sensor, LAW.spread, lags)
    product, variance = np.zeros(2), 0.0
    distance = HEIGHT / np.sin(np.radians(-ELEVATIONS[ELEVATIONS < 0.0]))
    for one in sensor.ground_by_range_m[2:]:
        rings = np.flatnonzero((distance >= one.low) & (distance < one.high))
        reach = np.broadcast_to(distance[rings, None], (len(rings), steps)).ravel()
        azimuth = np.radians(OFFSETS[rings, None] + 0.5 * np.arange(steps)).ravel()
        level = np.sqrt(reach**2 - HEIGHT**2)
        place = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.zeros(len(azimuth))], axis=-1)
        power = np.log(0.17 * HEIGHT / reach**3)
        threshold = brentq(
            lambda m, power=power, one=one: norm.cdf((power - m) / LAW.spread).mean() - one.share, -30, 0
        )
        law = RangeEquation(threshold, LAW.spread, 1.0)
        chance = [law.chance(reach, 0.17 * HEIGHT / reach, surface_deviation(place, (100 + at,))) for at in range(40)]
        first, second = (random.random((40, len(reach))) < chance for _ in range(2))
        first, second = (fate.reshape(40, -1, steps) - fate.mean() for fate in (first, second))
        product += one.rays * np.array([(first * np.roll(first, -lag, axis=-1)).mean() for lag in lags])
        variance += one.rays * first.var()
        if one.bin == "50-60":  # farther away hardly a ray returns
            assert found.over_sweeps[one.bin] == pytest.approx((first * second).mean() / first.var(), abs=0.06)
    assert [found.along_ring[lag] for lag in lags] == pytest.approx((product / variance).tolist(), abs=0.04)


@pytest.mark.slow
def test_the_command_writes_table_file_and_charts(reference, tmp_path, capsys):
    output = tmp_path / "out"
    content = measured(LAW)
    content["sensors"]["other"] = content["sensors"]["mine"]
    calibrate.main([str(reference(content)), "-o", str(output), "--sensor", "mine=vls128"])
    said = capsys.readouterr().out
    assert "  detection_law = [-11.6" in said
    assert "warning: other: not compared with any model" in said
    (record,) = json.loads((output / "calibration.json").read_text(encoding="utf-8"))["comparisons"]
    assert (record["measured"], record["model"]) == ("mine", "vls128")
    assert record["share"]["free"]["rms"] < 2e-3
    assert [one["lag"] for one in record["fate_along_ring"]] == [1, 5]
    assert {path.name for path in output.glob("*.png")} == {"ground.png", "vertical.png", "noise.png", "fate.png"}


def test_names_choose_the_pairs(sensor):
    catalogue = load_catalogue()
    assert pair({"vlp16": sensor, "mine": sensor}, catalogue, ["mine=vls128"]) == {
        "vlp16": catalogue["vlp16"],
        "mine": catalogue["vls128"],
    }
    for asked, sentence in (
        ([], "is named like a catalogue key"),
        (["mine"], "write MEASURED=KEY"),
        (["yours=vls128"], "where MEASURED is mine"),
        (["mine=vls129"], "did you mean vls128"),
    ):
        with pytest.raises(SeipError, match=sentence):
            pair({"mine": sensor}, catalogue, asked)
    with pytest.raises(SeipError, match="the drop-off of CARLA"):
        compare("mine", sensor, catalogue["type1"])


def without(*path):
    def change(content):
        *way, last = path
        for step in way:
            content = content[step]
        del content[last]

    return change


def setting(value, *path):
    def change(content):
        *way, last = path
        for step in way:
            content = content[step]
        content[last] = value

    return change


MINE = ("sensors", "mine")
FATE = "fate_correlation_along_ring_20_to_100_m"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (without("version"), "version is missing"),
        (setting(2, "version"), "version must be 1, not 2"),
        (setting({}, "sensors"), "sensors is empty"),
        (setting(7, *MINE), "sensor 'mine': all must be an object"),
        (without(*MINE, "beams"), "sensor 'mine': beams is missing"),
        (setting("high", *MINE, "identity", "mounting_height_m"), "identity.mounting_height_m must be a number"),
        (setting(0, *MINE, "identity", "mounting_height_m"), "mounting_height_m must lie between 0.1 and 100 m"),
        (setting([], *MINE, "ground_by_range_m"), "must have at least one bin each"),
        (setting(1.2, *MINE, "ground_by_range_m", 0, "share"), "bin 0-10: share must lie between 0 and 1, not 1.2"),
        (setting("a", *MINE, "ground_by_range_m", 0, "bin"), "bin must be two ascending ranges"),
        (setting("9-1", *MINE, "ground_by_range_m", 0, "bin"), "bin must be two ascending ranges"),
        (setting(0, *MINE, "ground_by_range_m", 0, "rays"), "rays must be 1 or more, not 0"),
        (setting([0.9, 0.1], *MINE, "vertical_by_range_m", 0, "sector_bootstrap95"), "two ascending shares"),
        (setting(0, *MINE, "range_noise_ground", 0, "robust_std_m"), "must lie between 0 and 100 m"),
        (setting({"no": 0.5}, *MINE, FATE), "distances in rays, 1 to 100, not 'no'"),
        (setting({"1": 1.5}, *MINE, FATE), "must lie between -1 and 1"),
        (setting([1.0], *MINE, "beams", "azimuth_offset_deg"), "one number for each of elevation_deg"),
        (setting(0.0, *MINE, "beams", "azimuth_step_deg"), "azimuth_step_deg must lie between"),
        (setting([90.0] * 61, *MINE, "beams", "elevation_deg"), "elevation_deg must lie between -90 and 90"),
    ],
)
def test_each_mistake_has_its_sentence(reference, change, sentence):
    content = copy.deepcopy(measured(LAW))
    change(content)
    with pytest.raises(SeipError, match=sentence):
        load_reference(reference(content))


@pytest.mark.parametrize("content", ["", "[", "[" * 100_000, "7"])
def test_what_is_no_json_of_measurements_is_refused(reference, content):
    with pytest.raises(SeipError, match=r"cannot read the measurements|all must be an object"):
        load_reference(reference(content))


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(SeipError, match="cannot read the measurements"):
        load_reference(tmp_path / "none.json")
