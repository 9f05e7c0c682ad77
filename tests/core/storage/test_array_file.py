"""Files of arrays: the program's own in their format and version, and npz files of other programs within limits."""

import gzip
import io
import resource
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.storage import xml_stream
from seip_addon.core.storage.array_file import ArrayFile
from seip_addon.core.storage.xml_stream import read_tags

ROOT = Path(__file__).resolve().parents[3]
PROFILE = ArrayFile("test.profile", 2, "profile", "measure it again", {"heights": "f8", "name": "U"})
ARRAYS = {"heights": np.array([0.0, 3.5]), "name": np.array(["kerb"])}


@pytest.mark.parametrize("compressed", [True, False])
def test_a_file_gives_what_was_written(tmp_path, compressed):
    profile = ArrayFile(PROFILE.schema, 2, "profile", "measure it again", PROFILE.arrays, compressed)
    profile.save(tmp_path / "p.npz", {"spacing": 4.0}, {"heights": [0, 3.5], "name": ["kerb"]})
    with PROFILE.reading(tmp_path / "p.npz") as (header, arrays):
        assert header == {"schema": "test.profile", "version": 2, "spacing": 4.0}
        assert arrays["heights"].dtype == np.float64
        assert {name: array.tolist() for name, array in arrays.items()} == {"heights": [0.0, 3.5], "name": ["kerb"]}


def _packed(**arrays):
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()


HEADER = np.array('{"schema": "test.profile", "version": 2}')
UNFIT = {
    "nothing": (b"", "damaged"),
    "no header": (_packed(**ARRAYS), "damaged"),
    "another format": (_packed(header=np.array('{"schema": "other", "version": 2}'), **ARRAYS), "of this version"),
    "another version": (
        _packed(header=np.array('{"schema": "test.profile", "version": 1}'), **ARRAYS),
        "of this version",
    ),
    "an array less": (_packed(header=HEADER, name=ARRAYS["name"]), "damaged"),
    "another type": (_packed(header=HEADER, heights=np.array([1, 2]), name=ARRAYS["name"]), "damaged"),
}


@pytest.mark.parametrize("name", UNFIT)
def test_a_file_that_does_not_fit_is_refused_with_its_remedy(tmp_path, name):
    content, words = UNFIT[name]
    path = tmp_path / "p.npz"
    path.write_bytes(content)
    with pytest.raises(SeipError, match=f"p.npz is .*{words}.*; measure it again"), PROFILE.reading(path):
        pass


def test_a_claim_of_64_gib_in_a_foreign_file_costs_no_memory(tmp_path):
    content = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (2**33,)}
    np.lib.format.write_array_header_1_0(content, claim)
    with zipfile.ZipFile(tmp_path / "sweep.npz", "w") as archive:
        archive.writestr("points.npy", content.getvalue() + bytes(80))
    script = (
        "import sys\nfrom pathlib import Path\n"
        "from seip_addon.core.base.errors import SeipError\nfrom seip_addon.core.storage.array_file import read_npz\n"
        "try:\n    read_npz(Path(sys.argv[1]), 1 << 40)\nexcept SeipError as error:\n    print(error)\n"
    )
    done = subprocess.run(  # noqa: S603  # our own script
        [sys.executable, "-c", script, str(tmp_path / "sweep.npz")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)),
    )
    assert done.returncode == 0, done.stderr
    assert "sweep.npz is damaged or not an npz file" in done.stdout


def test_a_huge_attribute_is_refused_at_once(tmp_path):
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(('<osm><node k="' + "a" * (96 << 20)).encode(), compresslevel=1))
    start = time.process_time()
    with pytest.raises(SeipError, match=r"place\.osm\.gz holds a tag or text of more than 8 MiB"):
        finish(read_tags(path, lambda *_: None))
    assert time.process_time() - start < 2.0  # it took more than five seconds when each chunk was read again


def test_a_file_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_stream, "_ALWAYS_UNPACKED", 1 << 20)
    path = tmp_path / "fcd.xml.gz"
    row = b'<timestep time="1"/>'
    with gzip.open(path, "wb", compresslevel=6) as file:
        file.write(b"<fcd-export>")
        for _ in range(4):
            file.write(row * ((1 << 20) // len(row)))
    with pytest.raises(SeipError, match="unpacks to more than 200 times its size"):
        finish(read_tags(path, lambda *_: None))


def test_large_files_of_ordinary_tags_are_read(tmp_path):
    path = tmp_path / "net.xml"
    shape = " ".join(f"{number},{number}" for number in range(100_000))
    path.write_text(f"<net>{f'<edge shape={chr(34)}{shape}{chr(34)}/>' * 12}</net>", encoding="utf-8")
    tags: list[str] = []
    finish(read_tags(path, lambda tag, _: tags.append(tag)))
    assert tags == ["net", *["edge"] * 12]


def test_elements_nested_without_end_are_refused_at_once(tmp_path):
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(b"<a>" * 1_000_000))
    tags: list[str] = []
    with pytest.raises(SeipError, match=r"place\.osm\.gz has more than 1,000 nested elements"):
        finish(read_tags(path, lambda tag, _: tags.append(tag)))
    assert len(tags) == 1000
