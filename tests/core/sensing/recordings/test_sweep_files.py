"""Sweeps in all formats against writers by hand, and files that are damaged."""

import struct
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.orientation import quaternion_of
from seip_addon.core.sensing.recordings.sweep_files import read_sweep
from tests.builders.recording_files import make_points, pcd_text, write_sweep_file
from tests.builders.scan_frames import rotation

FORMATS = (".pcd", ".bin", ".npz")


def read(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return read_sweep(path)


def refused(words, folder, name, content):
    with pytest.raises(SeipError, match=words) as caught:
        read(folder, name, content)
    assert name in str(caught.value)


def same(sweep, columns, atol=0.0):
    xyz = np.column_stack([columns[axis] for axis in "xyz"])
    np.testing.assert_allclose(sweep.points, xyz, rtol=0.0, atol=atol)
    assert (sweep.points.dtype, sweep.intensity.dtype) == (np.float32, np.float32)
    assert (sweep.intensity == columns["intensity"]).all()


@pytest.mark.parametrize("suffix", FORMATS)
def test_formats_hold_the_same(suffix, tmp_path):
    columns = make_points()
    sweep = read_sweep(write_sweep_file(tmp_path / f"a{suffix}", columns))
    same(sweep, columns)
    assert sweep.viewpoint is None


@pytest.mark.parametrize("data", ["ascii", "binary"])
@given(
    seed=st.integers(0, 1000),
    count=st.integers(0, 40),
    kind=st.sampled_from(["<f4", "<f8"]),
    ring=st.sampled_from(["<u1", "<u2", "<u4", "<u8", "<i2", "<i4", "<i8"]),
    names=st.sampled_from([("intensity", "ring"), ("i", "channel"), ("reflectivity", "laser_id")]),
    padding=st.integers(1, 3),
    data_order=st.permutations(range(6)),
)
def test_pcd(tmp_path_factory, data, seed, count, kind, ring, names, padding, data_order):
    points = make_points(seed, count)
    columns = [(axis, points[axis].astype(kind)) for axis in "xyz"]
    columns += [(names[0], points["intensity"]), (names[1], points["ring"].astype(ring))]
    columns += [("_", np.ones((count, padding), dtype="<u1"))]
    content = pcd_text(dict(columns[at] for at in data_order), data)
    same(read(tmp_path_factory.mktemp("pcd"), "a.pcd", content), points)


@given(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3), st.integers(0, 99))
def test_a_viewpoint_is_the_pose_of_the_sensor(tmp_path_factory, yaw, pitch, roll, seed):
    columns = make_points(seed)
    turn, at = rotation(yaw, pitch, roll), np.array([10.0, -20.0, 6.0])
    own = np.column_stack([columns[axis] for axis in "xyz"]).astype(float)
    site = (own @ turn.T + at).T
    words = " ".join(repr(number) for number in [*at.tolist(), *quaternion_of(turn).tolist()])
    content = pcd_text({**columns, **dict(zip("xyz", site, strict=True))}, viewpoint=words)
    sweep = read(tmp_path_factory.mktemp("pcd"), "a.pcd", content)
    same(sweep, columns, atol=1e-5)
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = turn, at
    np.testing.assert_allclose(sweep.viewpoint, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("more", [1, 2])
def test_further_columns_of_bin_files_are_ignored(more, tmp_path):
    columns = make_points(count=40)  # which is a whole number of points of four columns, too
    table = np.column_stack([columns[name] for name in ("x", "y", "z", "intensity")] + [np.zeros(40)] * more)
    same(read(tmp_path, "a.bin", table.astype("<f4").tobytes()), columns)


@pytest.mark.parametrize("suffix", FORMATS)
def test_cut_files(suffix, tmp_path):
    """A cut between two points of a format without a header or end gives the points before."""
    columns = make_points(count=203)
    xyz = np.column_stack([columns[axis] for axis in "xyz"])
    content = write_sweep_file(tmp_path / f"whole{suffix}", columns).read_bytes()
    path, whole = tmp_path / f"a{suffix}", []
    for part in range(50):
        path.write_bytes(content[: len(content) * part // 50])
        try:
            sweep = read_sweep(path)
        except SeipError as error:
            message = str(error)
            assert path.name in message
        else:
            assert (sweep.points == xyz[: len(sweep)]).all()
            whole.append(part)
    if suffix == ".bin":
        assert whole == [part for part in range(1, 50) if len(content) * part // 50 % 16 == 0]
    else:
        assert not whole


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        ("POINTS differ", {"POINTS": 3}),
        ("announces", {"WIDTH": 3, "POINTS": 3}),
        ("WIDTH is not a whole number up to", {"WIDTH": 10**11, "POINTS": 10**11}),
        ("announces", {"WIDTH": 10_000_000, "POINTS": 10_000_000}),
        ("HEIGHT is not", {"HEIGHT": "-1"}),
        ("WIDTH is not", {"WIDTH": None}),
        ("differ in length", {"FIELDS": "x y z"}),
        ("differ in length", {"FIELDS": None}),
        ("unknown type", {"TYPE": "F F F F Q"}),
        ("unknown type", {"SIZE": "4 4 4 4 3"}),
        ("more than", {"COUNT": "1 1 1 1 9999"}),
        ("no x", {"FIELDS": "a y z intensity ring"}),
        ("no x and no z", {"FIELDS": "a y b intensity ring"}),
        ("seven numbers", {"VIEWPOINT": "0 0 0 1"}),
        ("seven numbers", {"VIEWPOINT": "0 0 nan 1 0 0 0"}),
        ("length 1", {"VIEWPOINT": "0 0 0 0 0 0 0"}),
        ("no PCD header", {"DATA": "binary_packed"}),
        ("no PCD header", {"FIELDS": "x " * 40_000}),
    ],
)
@pytest.mark.parametrize("data", ["ascii", "binary"])
def test_contradicting_headers_of_pcd(data, words, changes, tmp_path):
    refused(words, tmp_path, "a.pcd", pcd_text(make_points(count=6), data, **changes))


@pytest.mark.parametrize(
    ("words", "name", "content"),
    [
        ("is empty", "a.bin", b""),
        ("is empty", "a.pcd", b""),
        ("not whole points of 4 to 6", "a.bin", bytes(28)),
        ("intensity is nan", "a.bin", np.array([1, 2, 3, np.nan], "<f4").tobytes()),
        ("map coordinates", "a.bin", np.array([1, 2e4, 3, 0], "<f4").tobytes()),
        ("it is compressed; write it as binary", "a.pcd", pcd_text(make_points(), "binary_compressed")),
        ("not a text file", "a.pcd", b"\xff\nDATA ascii\n"),
        ("damaged or not an npz file", "a.npz", b"PK\x03\x04 and so on"),
        ("not a sweep: give a file", "a.csv", b"x,y,z\n1,2,3\n"),
    ],
)
def test_refusals(words, name, content, tmp_path):
    refused(words, tmp_path, name, content)


def test_an_npz_that_unpacks_to_more_than_any_sweep(tmp_path):
    archive = zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1)
    with archive, archive.open("x.npy", "w") as file:
        header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (150000000,), }".ljust(117) + b"\n"
        file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
        for _ in range(1200):
            file.write(bytes(10**6))
    assert (tmp_path / "a.npz").stat().st_size < 1e7
    with pytest.raises(SeipError, match="more than 1,074 MB"):
        read_sweep(tmp_path / "a.npz")


@given(content=st.binary(max_size=300), suffix=st.sampled_from(FORMATS))
def test_random_bytes(tmp_path_factory, content, suffix):
    try:
        sweep = read(tmp_path_factory.mktemp("any"), f"a{suffix}", content)
    except SeipError:
        return
    assert suffix == ".bin"
    assert np.isfinite(sweep.points).all()
