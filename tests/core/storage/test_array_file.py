"""Files of arrays: the program's own in their format and version, and npz files of other programs within limits."""

from __future__ import annotations

import io
import resource
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.storage.array_file import ArrayFile

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
    assert "claims 68,719,476,736 bytes" in done.stdout
