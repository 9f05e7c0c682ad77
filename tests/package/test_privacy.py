"""Nothing that is published tells of the machine it was made on."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PRIVATE = re.compile(rb"(?<![\w.$}\"'])/(?:home|root|work|Users)/\w|[A-Z]:\\\\?Users\\")


def content(path: Path) -> bytes:
    """Bytes of a file; those of a .blend unpacked."""
    raw = path.read_bytes()
    if path.suffix == ".blend" and raw.startswith(b"\x28\xb5\x2f\xfd"):
        zstandard = pytest.importorskip("zstandard")
        with zstandard.ZstdDecompressor().stream_reader(raw, read_across_frames=True) as stream:
            return stream.read()
    return raw


def published() -> list[Path]:
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is no git checkout")
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout  # noqa: S607
    return [ROOT / name for name in names.decode().split("\0") if name and (ROOT / name).is_file()]


def test_no_file_names_a_private_folder():
    found = {path.relative_to(ROOT): PRIVATE.search(content(path)) for path in published()}
    assert not {str(path): match.group() for path, match in found.items() if match}


def test_no_file_is_heavy():
    """Clones stay light: scenes are small, wheels are downloaded."""
    assert not [path for path in published() if path.stat().st_size > 5_000_000]


def test_a_private_folder_is_found():
    assert PRIVATE.search(b"see " + b"/home" + b"/someone/map.xodr")
    assert not PRIVATE.search(b"relative/home/x and https://example.org/work/x")
