"""Stored results are keyed by the program that made them, wherever it lies."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DIGEST = """
import sys
from {0}.core.storage.source_digest import source_digest
print(source_digest())
"""


@pytest.fixture
def copy(tmp_path):
    """A checkout's package, to be changed."""
    shutil.copytree(ROOT / "seip_addon", tmp_path / "seip_addon", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def key(folder, package="seip_addon", path=""):
    script = f"import sys; sys.path.insert(0, {str(path or folder)!r})\n{DIGEST.format(package)}"
    command = [sys.executable, "-c", script]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.strip()  # noqa: S603


def test_results_have_another_key_where_a_line_of_the_core_has_changed(copy):
    before = key(copy)
    path = copy / "seip_addon" / "core" / "sensing" / "lidar" / "noisy_returns.py"
    path.write_text(path.read_text(encoding="utf-8") + "\nCHANGED = True\n", encoding="utf-8")
    assert key(copy) != before


@pytest.mark.slow
def test_it_is_the_same_in_an_archive_and_under_the_name_that_blender_gives(copy):
    expected = key(ROOT)
    assert key(copy) == expected
    archive = copy / "packed.zip"
    with zipfile.ZipFile(archive, "w") as packed:
        for path in (copy / "seip_addon").rglob("*.py"):
            packed.write(path, path.relative_to(copy))
    (copy / "empty").mkdir()
    assert key(copy / "empty", path=archive) == expected
    extension = copy / "bl_ext" / "user_default" / "seip"
    extension.parent.mkdir(parents=True)
    shutil.copytree(copy / "seip_addon", extension / "seip_addon")
    assert key(copy, package="bl_ext.user_default.seip.seip_addon") == expected
