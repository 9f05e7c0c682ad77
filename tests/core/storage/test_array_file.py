"""What an npz holds is checked once, where it is read: sizes before arrays, and every figure against the others."""

from __future__ import annotations

import io
import resource
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.storage import array_file
from seip_addon.core.storage.array_file import _array
from tests.builders.npz_by_hand import claiming, contents, write
from tests.builders.traffic_by_hand import USERS, make_trajectories

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = ROOT / "scenes" / "junction_traffic" / "run-1.npz"


@pytest.fixture
def stored(tmp_path):
    """A file of two road users with four samples each."""
    ways = [[(0.1 * step, step + 9.0 * user, 0.0, 0.0, 0.1 * step, 0.0) for step in range(4)] for user in range(2)]
    path = tmp_path / "run.npz"
    make_trajectories(*ways, users=USERS).save(path)
    return path


def _user_too_many(header, _):
    header["users"].insert(0, dict(header["users"][0], name="ghost"))


def _user_missing(header, _):
    del header["users"][0]


def _set(array, index, value):
    def change(_, arrays):
        arrays[array][index] = value

    return change


def _user(**figures):
    def change(header, _):
        header["users"][1] |= figures

    return change


def _typed(name, dtype):
    def change(_, arrays):
        arrays[name] = arrays[name].astype(dtype)

    return change


def _cut(name):
    def change(_, arrays):
        arrays[name] = arrays[name][:-1]

    return change


def _backwards(_, arrays):
    arrays["time"][:4] = arrays["time"][:4][::-1].copy()


def _nobody(header, arrays):
    header["users"] = []
    arrays["first"] = np.zeros(1, dtype=np.int64)
    for name in ("time", "position", "yaw", "pitch", "speed"):
        arrays[name] = arrays[name][:0]


CONTRADICTIONS = {
    "a user too many": (_user_too_many, "names 3 road users and has the samples of 2"),
    "a user missing": (_user_missing, "names 1 road users and has the samples of 2"),
    "nobody": (_nobody, "names 0 road users"),
    "a position that is no number": (_set("position", (5, 1), np.nan), "position has the value nan"),
    "an endless time": (_set("time", 7, np.inf), "time has the value inf"),
    "an origin off the Earth": (_set("origin", 0, 1e30), "origin has the value"),
    "a reversed time": (_backwards, "the times of road user 'a' do not ascend"),
    "an equal time": (_set("time", 5, 0.0), "the times of road user 'b' do not ascend"),
    "a month": (_set("time", 7, 1e9), "it lasts"),
    "a continent": (_set("position", (7, 0), 9e6), "km apart"),
    "samples of nobody": (_set("first", 1, 9), "its samples are not those"),
    "samples before the first": (_set("first", 0, 1), "its samples are not those"),
    "a leap of a turn": (_set("yaw", 2, 9.0), "more than half a turn"),
    "a steep road": (_set("pitch", 2, 3.0), "pitch has the value 3"),
    "a warp": (_set("speed", 2, 1e30), "speed has the value"),
    "fewer speeds": (_cut("speed"), "speed has the length 7 in place of 8"),
    "whole numbers": (_typed("position", np.int64), "position is of the type int64"),
    "less exact": (_typed("yaw", np.float32), "yaw is of the type float32"),
    "an unknown category": (_user(category="tank"), "road user 'b' is 'tank'"),
    "a size of no one": (_user(length=float("1e9")), "road user 'b' is"),
    "a size in words": (_user(height="tall"), "road user 'b' is"),
    "a negative size": (_user(width=-2.0), "road user 'b' is"),
    "a glowing paint": (_user(paint=3.0), "paint of road user 'b'"),
    "an unknown figure": (_user(wings=2), "damaged"),
}


@pytest.mark.parametrize(("change", "sentence"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_trajectories_that_contradict_themselves_are_refused(stored, change, sentence):
    header, arrays = contents(stored)
    change(header, arrays)
    with pytest.raises(SeipError, match="import or simulate them again") as refusal:
        Trajectories.load(write(stored, header, arrays))
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 400


def test_a_file_of_the_version_without_a_digest_is_read(stored):
    before = Trajectories.load(stored)
    assert Trajectories.load(write(stored, *contents(stored))).key == before.key


@pytest.mark.parametrize("name", ["time", "position", "header"])
def test_another_content_than_was_written_is_noticed(stored, name):
    with np.load(stored) as read:
        arrays = {key: read[key] for key in read.files}
    if name == "header":
        arrays["header"] = np.array(str(arrays["header"]).replace("12.0", "12.5"))
    else:
        arrays[name] = arrays[name] + 1.0
    np.savez(stored, **arrays)
    with pytest.raises(SeipError, match="differs from its digest"):
        Trajectories.load(stored)


def test_a_file_with_a_digest_cannot_pass_as_one_without(stored):
    header, arrays = contents(stored)
    with pytest.raises(SeipError, match="damaged"):
        Trajectories.load(write(stored, header, arrays, version=2))
    with pytest.raises(SeipError, match="differs from its digest"):
        Trajectories.load(write(stored, {**header, "digest": "0" * 64}, arrays))


def test_a_claim_of_64_gib_costs_no_memory(stored):
    claiming(stored, "position", (2**36 // 24, 3))
    script = (
        "import resource, sys\n"
        "from seip_addon.core.errors import SeipError\n"
        "from seip_addon.core.sensing.traffic.trajectories import Trajectories\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "try:\n    Trajectories.load(sys.argv[1])\n"
        "except SeipError as error:\n    print(error)\n"
        "assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 50_000\n"
    )
    done = subprocess.run(  # noqa: S603  # our own script
        [sys.executable, "-c", script, str(stored)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)),
    )
    assert done.returncode == 0, done.stderr
    assert "claims 68,719,476,848 bytes" in done.stdout


def test_a_file_that_does_not_fit_into_memory_is_refused_by_its_size(stored, monkeypatch):
    monkeypatch.setattr(array_file, "MAX_BYTES", 400)
    with pytest.raises(SeipError, match="it holds more than"):
        Trajectories.load(stored)


def test_arrays_that_do_not_belong_there_are_refused(stored):
    header, arrays = contents(stored)
    for names in (arrays.keys() - {"yaw"}, arrays.keys() | {"more"}):
        write(stored, header, {name: arrays.get(name, np.zeros(3)) for name in names})
        with pytest.raises(SeipError, match="missing or additional arrays"):
            Trajectories.load(stored)


def test_nothing_may_stand_before_the_archive(stored):
    stored.write_bytes(b"#!/bin/sh\n" + stored.read_bytes())
    with pytest.raises(SeipError, match="does not begin with an array"):
        Trajectories.load(stored)


@pytest.mark.parametrize("method", [1, 9, 12, 14, 93, 99])
def test_packings_that_numpy_never_uses_are_refused(stored, method):
    content = bytearray(stored.read_bytes())
    for mark, offset in ((b"PK\x03\x04", 8), (b"PK\x01\x02", 10)):
        at = content.find(mark)
        while at >= 0:
            struct.pack_into("<H", content, at + offset, method)
            at = content.find(mark, at + 1)
    stored.write_bytes(content)
    with pytest.raises(SeipError, match="damaged"):
        Trajectories.load(stored)


def test_a_flipped_bit_is_a_sentence_or_nothing_lost(tmp_path):
    whole = SHIPPED.read_bytes()
    key = Trajectories.load(SHIPPED).key
    random = np.random.default_rng(5)
    with zipfile.ZipFile(SHIPPED) as archive:
        begins = [*(info.header_offset for info in archive.infolist()), archive.start_dir]
    near = [begin + offset for begin in begins for offset in range(0, 60, 7)]
    places = [*near, *random.integers(len(whole), size=100).tolist(), *range(len(whole) - 400, len(whole), 13)]
    path = tmp_path / "damaged.npz"
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(random.integers(8))
        path.write_bytes(damaged)
        try:
            assert Trajectories.load(path).key == key
        except SeipError as error:
            assert "\n" not in str(error)  # noqa: PT017  # whatever is refused is refused in a sentence


THREADS = """
import gc, sys, time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from seip_addon.core.sensing.traffic.trajectories import Trajectories
gc.set_threshold(50)
gc.callbacks.append(lambda *_: time.sleep(1e-5))  # threads change amid a collection, wherever that begins
with ThreadPoolExecutor(4) as pool:
    print(*set(pool.map(lambda _: Trajectories.load(Path(sys.argv[1])).key, range(60))))
"""


def test_files_are_read_in_threads():
    command = [sys.executable, "-c", THREADS, str(SHIPPED)]
    read = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S603
    assert read.stdout.split() == [Trajectories.load(SHIPPED).key]


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("packed", [np.savez, np.savez_compressed])
def test_arrays_are_as_numpy_reads_them(order, packed):
    random = np.random.default_rng(3)
    for shape in ((), (0,), (3, 0), (200_000,), (5, 7), (2, 3, 4)):
        for dtype in ("<f4", "<f8", "<i8", "|b1", "|u1", "<U5"):
            array = np.asarray(random.integers(-99, 99, shape).astype(dtype), order=order)
            file = io.BytesIO()
            packed(file, one=array)
            with zipfile.ZipFile(file) as archive:
                found = _array(archive, "one.npy")
            assert (found.dtype, found.shape, found.flags.writeable) == (array.dtype, shape, True)
            assert found.flags.f_contiguous == array.flags.f_contiguous
            np.testing.assert_array_equal(found, array)
