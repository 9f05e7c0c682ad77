"""Stored results are keyed by the code that they follow from, all of it, wherever it lies."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from seip_addon.core.storage.source_digest import _sources

ROOT = Path(__file__).resolve().parents[3]
DIGEST = """
import sys
from {0}.core.storage.source_digest import source_digest
print(source_digest("{0}.core." + sys.argv[1]))
"""
LOADED = """
import sys, importlib
importlib.import_module(sys.argv[1])
print(*(name for name in sys.modules if name.startswith("seip_addon.core")))
"""


def output(script, *arguments, cwd=ROOT, path=""):
    where = f"import sys; sys.path.insert(0, {str(path or cwd)!r})\n"
    command = [sys.executable, "-c", where + script, *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=True).stdout.strip()  # noqa: S603


@pytest.fixture
def copy(tmp_path):
    """A checkout's package, to be changed."""
    shutil.copytree(ROOT / "seip_addon", tmp_path / "seip_addon", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def key(folder, entry="sensing.visibility.grid", package="seip_addon", path=""):
    return output(DIGEST.format(package), entry, cwd=folder, path=path)


@pytest.mark.parametrize("entry", ["seip_addon.core.sensing.visibility.grid"])
def test_all_that_is_loaded_is_in_the_digest(entry):
    loaded = set(output(LOADED, entry).split()) - {"seip_addon.core.storage.source_digest"}
    assert loaded - {"seip_addon.core.storage.source_digest"} <= set(_sources(entry))


def test_scans_have_another_key_where_their_code_has_changed(copy):
    before = key(copy, "sensing.scans.run_folder")
    path = copy / "seip_addon" / "core" / "sensing" / "lidar" / "noisy_returns.py"
    path.write_text(path.read_text(encoding="utf-8") + "\nCHANGED = True\n", encoding="utf-8")
    assert key(copy, "sensing.scans.run_folder") != before


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
