"""What goes into the extension, and what does not."""

import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

pytest.importorskip("bpy", reason="Blender's extension tool comes with the bpy module")

from headless import build_extension
from headless.set_up import LOCK, requirements

ROOT = Path(__file__).resolve().parents[2]
FAKE_WHEEL = "thing-1.0-py3-none-any.whl"


@pytest.fixture
def built(tmp_path, monkeypatch):
    """The zip for Linux, with an empty wheel in place of the real ones, and a stray file in the checkout."""
    wheel = tmp_path / FAKE_WHEEL
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("thing-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\n")
    monkeypatch.setattr(build_extension, "STAGING", tmp_path / "staging")
    monkeypatch.setattr(build_extension, "fetch_wheels", lambda _python, _platform: [wheel])
    return build_extension.build("blender4.5", "linux-x64", tmp_path / "out")


def test_a_wheel_that_is_another_than_the_locked_one_is_not_bundled(tmp_path):
    name = next(line.split()[1] for line in LOCK.read_text().splitlines() if "shapely" in line)
    (tmp_path / name).write_bytes(b"forged")
    with pytest.raises(SystemExit, match=r"is not the wheel of that name in wheels\.lock"):
        build_extension.check_wheels([tmp_path / name])


def test_the_checkout_itself_is_a_valid_extension():
    build_extension.blender_extension("validate", str(ROOT))


def test_the_zip_holds_the_add_on_and_nothing_else(built):
    with zipfile.ZipFile(built) as archive:
        names = set(archive.namelist())
    expected = {"blender_manifest.toml", "__init__.py", "LICENSE", f"wheels/{FAKE_WHEEL}"}
    expected |= {"scenes/junction.toml", "scenes/junction.xodr", "scenes/junction_traffic/run-1.npz"}
    package = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "seip_addon").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert names == expected | package


def test_the_manifest_in_the_zip_lists_platform_and_wheels(built):
    with zipfile.ZipFile(built) as archive:
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert manifest["platforms"] == ["linux-x64"]
    assert manifest["wheels"] == [f"./wheels/{FAKE_WHEEL}"]
    kept = build_extension.manifest()
    assert {key: manifest[key] for key in kept} == kept


@pytest.mark.parametrize("name", build_extension.BUILDS)
def test_the_manifest_lets_the_zip_into_its_own_blender_alone(name):
    manifest = tomllib.loads(build_extension.completed_manifest(name, "linux-x64", []))
    build = build_extension.BUILDS[name]
    assert manifest["blender_version_min"] == build.first
    assert manifest.get("blender_version_max", "") == build.limit


def test_one_version_stands_in_manifest_and_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert build_extension.manifest()["version"] == project["version"]


@pytest.mark.parametrize(
    ("name", "platform"),
    [
        pytest.param(
            name, at, marks=pytest.mark.slow if (name, at) == ("blender4.5", "linux-x64") else pytest.mark.long
        )
        for name, build in build_extension.BUILDS.items()
        for at in build.platforms
    ],
)
def test_every_pin_has_one_wheel(name, platform, tmp_path, monkeypatch):
    build = build_extension.BUILDS[name]
    if platform != "linux-x64":
        monkeypatch.setattr(build_extension, "WHEELS", tmp_path)
    files = build_extension.fetch_wheels(build.python, platform)
    wheels = {name: (version, tags) for name, version, _, tags in (parse_wheel_filename(file.name) for file in files)}
    pins = [Requirement(pin) for pin in requirements("extension")]
    assert len(files) == len(pins)
    for pin in pins:
        version, tags = wheels[canonicalize_name(pin.name)]
        assert version in pin.specifier
        assert {tag.interpreter for tag in tags} & {"py3", f"cp{build.python.replace('.', '')}"}
