"""Calibration files of units: each format gives the same beams, and each mistake has its sentence."""

import json
import math

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.unit_files import MAX_BYTES, read_unit_file
from tests.builders.unit_text import ELEVATIONS, FILES, OFFSETS, hesai, ouster, robosense, xml, yaml

SHIPPED = load_catalogue()
SIXTEEN = np.linspace(15.0, -15.0, 16).tolist()


@pytest.fixture
def written(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_text(text if isinstance(text, str) else json.dumps(text), encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("name", FILES)
def test_each_format_holds_the_same_beams(written, name):
    beams = read_unit_file(written(name, FILES[name]))
    np.testing.assert_allclose(beams.elevations, ELEVATIONS, atol=1e-12)
    np.testing.assert_allclose(beams.azimuth_offsets, OFFSETS, atol=1e-12)


@pytest.mark.parametrize("nested", [False, True])
def test_metadata_of_an_ouster_find_their_model_and_its_mode(written, nested):
    base = SHIPPED["os1_128"]
    elevations, offsets = np.linspace(20.9, -21.8, 128).tolist(), [4.2, 1.4, -1.4, -4.2] * 32
    content = ouster(elevations, offsets, "OS-1-128-U1", "2048x20", nested=nested)
    model = load_catalogue([written("any.json", content)])["os1_128"]
    np.testing.assert_allclose(np.degrees(model.elevations), elevations)
    np.testing.assert_allclose(np.degrees(model.azimuth_offsets), offsets)
    assert (model.rotation_rate, model.azimuth_count, model.points_per_second) == (20.0, 2048, 2048 * 20 * 128)
    assert (model.law, model.price_range, model.max_range) == (base.law, base.price_range, base.max_range)
    assert model.source.endswith("; beams of any.json")
    assert load_catalogue().keys() == SHIPPED.keys()


@pytest.mark.parametrize(
    ("name", "content"),
    [("unit.json", ouster(SIXTEEN, [0.0] * 16, "", "")), ("unit.csv", hesai(SIXTEEN, [370.0 - 180.0] * 16))],
)
def test_a_key_names_the_model_whose_beams_are_replaced(written, name, content):
    path = written(name, content)
    model = load_catalogue([f"vlp16={path}"])["vlp16"]
    base = SHIPPED["vlp16"]
    np.testing.assert_allclose(np.degrees(model.elevations), SIXTEEN)
    assert (np.abs(model.azimuth_offsets) <= math.pi).all()
    assert (model.rotation_rate, model.azimuth_count) == (base.rotation_rate, base.azimuth_count)
    with pytest.raises(SeipError, match="does not say which LiDAR it is of: name one, as in KEY=unit"):
        load_catalogue([path])


def test_the_name_of_the_file_names_the_model_too(written, monkeypatch, tmp_path):
    path = written("vlp16.xml", xml(SIXTEEN, [0.5] * 16))
    assert np.degrees(load_catalogue([path])["vlp16"].azimuth_offsets) == pytest.approx([0.5] * 16)
    monkeypatch.chdir(tmp_path)
    assert load_catalogue(["vlp16=vlp16.xml"])["vlp16"].azimuth_offsets[3] == pytest.approx(math.radians(0.5))


def test_a_unit_of_a_model_of_ones_own(written):
    own = written(
        "mine.toml",
        '[mine]\nname = "M"\nmanufacturer = "M"\nsource = "s"\nelevations_deg = [1.0, 0.0, -1.0, -2.0]\n'
        "range_m = [0.5, 90.0]\npoints_per_second = 40000\nrotation_rate_hz = 10\nprice_usd = [1, 2]\n",
    )
    unit = written("unit.csv", robosense())
    assert np.degrees(load_catalogue([own, f"mine={unit}"])["mine"].elevations) == pytest.approx(ELEVATIONS)


def test_another_number_of_channels_is_refused(written):
    unit = written("unit.csv", robosense())
    with pytest.raises(SeipError, match=r"unit\.csv has 4 beams, but LiDAR 'vlp16' has 16"):
        load_catalogue([f"vlp16={unit}"])
    with pytest.raises(SeipError, match="no LiDAR 'vlp17' in the catalogue; did you mean vlp16"):
        load_catalogue([f"vlp17={unit}"])
    with pytest.raises(SeipError, match="4 beams, but LiDAR 'os1_128' has 128"):
        load_catalogue([written("legacy.json", ouster(product="OS-1-128-A0"))])


def changed(content, value, *path):
    *way, last = path
    inner = content
    for step in way:
        inner = inner[step]
    inner[last] = value
    return content


LAUGHS = (
    '<!DOCTYPE x [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY a{n} "&a{n - 1 or ""};&a{n - 1 or ""};">' for n in range(1, 30))
    + "]><x>&a29;</x>"
)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("u.json", "{", "is not valid JSON"),
        ("u.json", "[" * 100_000, "is broken"),
        ("u.json", "7", "has a content that is not an object"),
        ("u.json", {}, "has no list of numbers beam_altitude_angles"),
        ("u.json", ouster() | {"beam_altitude_angles": []}, "both at the top and in beam_intrinsics"),
        ("u.json", changed(ouster(), 3, "beam_intrinsics"), "has a beam_intrinsics that is not an object"),
        ("u.json", changed(ouster(), [1.0], "beam_intrinsics", "beam_azimuth_angles"), "4 elevations and 1 azimuth"),
        ("u.json", changed(ouster(), 64, "lidar_data_format", "pixels_per_column"), "for 64 pixels_per_column"),
        ("u.json", changed(ouster(), [4], "lidar_data_format", "pixels_per_column"), "for \\[4\\] pixels_per_column"),
        ("u.json", changed(ouster(), "fast", "config_params", "lidar_mode"), "the lidar_mode 'fast', which is not"),
        ("u.json", ouster([0.0] * 4, [0.0] * 4), "the same angles for its beams 1 and 2"),
        ("u.json", ouster([90.0, 1, 2, 3]), "has an elevation that is 90, not -89.999 to 89.999 degrees"),
        ("u.json", ouster(offsets=[1, 2, 3, 361]), "an azimuth offset that is 361, not -360 to 360 degrees"),
        ("u.json", '{"beam_altitude_angles": [NaN, 1], "beam_azimuth_angles": [0, 0]}', "not a sensible number"),
        ("u.json", '{"beam_altitude_angles": [true, 1], "beam_azimuth_angles": [0, 0]}', "no list of numbers"),
        ("u.json", "1" * 5000, "limit"),
        ("u.xml", "<DB>", "is broken"),
        ("u.xml", LAUGHS, "declares entities"),
        ("u.xml", '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><x>&a;</x>', "declares entities"),
        ("u.xml", "<x/>", "holds 0 elevations"),
        ("u.xml", xml().replace("<id_>1<", "<id_>0<"), "has two lasers of id_ 0"),
        ("u.xml", xml().replace("<id_>1<", "<id_>one<"), "has 'one' for id_, which is not a sensible number"),
        ("u.xml", xml().replace("<id_>1<", "<id_>1.5<"), "has '1.5' for id_, which is not a whole number"),
        ("u.xml", xml().replace("vertCorrection_>13.5", "vertCorrection_>up"), "has 'up' for vertCorrection_"),
        ("u.yaml", "a: 1\n", "has no line 'lasers:'"),
        ("u.yaml", "lasers:\n  laser_id: 1\n", "before the first of its lasers"),
        ("u.yaml", yaml().replace("laser_id: 1,", "laser_id: 2,"), "has two lasers of laser_id 2"),
        ("u.yaml", yaml().replace("laser_id: 1,", "laser_id: &x 1,"), "no plain maps of numbers"),
        ("u.yaml", yaml().replace("laser_id: 1,", ""), "has 'None' for laser_id"),
        ("u.yaml", yaml().replace("num_lasers: 4", "num_lasers: 64"), "has 4 lasers where num_lasers is 64"),
        ("u.csv", "", "is empty"),
        ("u.csv", "Channel,Elevation\n1,2\n", "has no column azimuth"),
        ("u.csv", hesai() + "\n7,1", "has a row of 2 fields: '7,1'"),
        ("u.csv", hesai() + "\n4,1,2", "has a channel twice"),
        ("u.csv", hesai() + "\nx,1,2", "has 'x' for channel"),
        ("u.csv", "1,2,3,4\n", "has a row that is not elevation, azimuth and, maybe, ring"),
        ("u.csv", "1,2\n3,up\n", "has 'up' for azimuth"),
        ("u.csv", "1,2,0.5\n3,4,1\n", "has '0.5' for ring"),
        ("u.csv", "1,2\n", "holds 1 elevations"),
        ("u.csv", f"1,{'2' * 200_000}\n", "is broken: field larger than field limit"),
        ("u.csv", "1,2\n" * (MAX_BYTES // 4 + 1), "has over 4 MB"),
    ],
)
def test_each_mistake_has_its_sentence(written, name, content, sentence):
    path = written(name, content)
    with pytest.raises(SeipError, match=sentence) as refused:
        read_unit_file(path)
    assert "\n" not in str(refused.value)


def test_what_cannot_be_read_is_refused(tmp_path):
    (tmp_path / "u.csv").write_bytes(b"\xff\xfe\x00")
    for name in ("u.csv", "none.json", "vlp16=none.json"):
        with pytest.raises(SeipError, match="cannot read the calibration"):
            load_catalogue([tmp_path / name if name[0] != "v" else name])


@pytest.mark.slow
def test_xml_as_deep_as_the_limit_lets_it_be_is_refused(written):
    depth = MAX_BYTES // 7 - 1
    with pytest.raises(SeipError, match=r"holds 0 elevations|is broken"):
        read_unit_file(written("u.xml", "<a>" * depth + "</a>" * depth))
