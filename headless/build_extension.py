"""Build the Blender extension: the add-on with the wheels of all it imports, one zip for each Blender and platform.

    python -m headless.build_extension --platforms linux-x64 windows-x64 macos-arm64

The wheels are the group ``extension`` of the pins in ``pyproject.toml``, in `wheels/`, checked against ``wheels.lock``.
"""

import argparse
import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from headless.set_up import LOCK, requirements

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "wheels"
STAGING = ROOT / "build" / "extension"
EXAMPLE = ("scenes/junction.toml", "scenes/junction.xodr", "scenes/junction_traffic/run-1.npz")
CONTENTS = ("__init__.py", "LICENSE", "seip_addon", *EXAMPLE)

WHEEL_TAGS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_14_0_arm64",),
}
"""Wheel tags by Blender's name of a platform: no newer system than Blender itself asks for."""


@dataclass(frozen=True)
class Build:
    """A build of Blender that has a zip of its own: wheels are compiled for its Python.

    Parameters
    ----------
    first, limit : str
        The zip installs in this version of Blender and later ones, and in none from the limit on, where there is one.
    """

    python: str
    first: str
    limit: str = ""
    platforms: Collection[str] = tuple(WHEEL_TAGS)


BUILDS = {
    "blender4.5": Build("3.11", "4.5.0", "5.1.0"),
    "blender5.1": Build("3.13", "5.1.0"),
    "debian": Build("3.14", "5.1.0", platforms=("linux-x64",)),
}
"""Blender 4.5 LTS to 5.0; Blender 5.1, 5.2 LTS and later; Blender 5.2 LTS as Debian builds it."""


def main(arguments: list[str]) -> None:
    """Build and check a zip for each build of Blender, on each of the platforms asked for."""
    parser = argparse.ArgumentParser(prog="build_extension", description="Build the Blender extension into dist/.")
    parser.add_argument("--platforms", nargs="+", choices=WHEEL_TAGS, default=["linux-x64"])
    parser.add_argument("--builds", nargs="+", choices=BUILDS, default=list(BUILDS), help="of Blender (default: all)")
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder of the zips (default: dist)")
    options = parser.parse_args(arguments)
    for platform in options.platforms:
        for name in (name for name in options.builds if platform in BUILDS[name].platforms):
            print(build(name, platform, options.output))  # noqa: T201  # a command's output


def build(name: str, platform: str, output: Path) -> Path:
    """Return the finished zip for a build of Blender on a platform, validated by Blender's own tool."""
    staged = stage(name, platform, fetch_wheels(BUILDS[name].python, platform))
    output.mkdir(parents=True, exist_ok=True)
    target = output.resolve() / f"seip-{manifest()['version']}-{name}-{platform.replace('-', '_')}.zip"
    blender_extension("build", "--source-dir", str(staged), "--output-filepath", str(target))
    blender_extension("validate", str(target))
    return target


def manifest() -> dict[str, object]:
    """Return the manifest as it is kept, without platforms and wheels."""
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def fetch_wheels(python: str, platform: str) -> list[Path]:
    """Return the wheels for a Python and platform, downloaded when the pins have changed since the last time.

    A wheel without compiled code is taken where there is one: it is the same file in every zip.
    """
    folder = WHEELS / f"{platform}-python{python}"
    stamp = folder / "pins.json"
    pins = requirements("extension")
    wanted = json.dumps({"pins": pins, "tags": WHEEL_TAGS[platform]})
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != wanted:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        tags = [f"--platform={tag}" for tag in WHEEL_TAGS[platform]]
        compiled = [pin for pin in pins if not download(folder, [pin], python, ["--platform=any", "--abi=none"])]
        if not download(folder, compiled, python, ["--implementation=cp", *tags]):
            sys.exit(f"cannot download the wheels for {platform}, Python {python}: see pip's message above")
        stamp.write_text(wanted, encoding="utf-8")
    wheels = sorted(folder.glob("*.whl"))
    check_wheels(wheels)
    return wheels


def check_wheels(wheels: list[Path]) -> None:
    """End with one sentence where a wheel is not, to the last bit, the one of its name in ``wheels.lock``."""
    known = {tuple(line.split()) for line in LOCK.read_text(encoding="utf-8").splitlines()}
    for wheel in wheels:
        if (hashlib.sha256(wheel.read_bytes()).hexdigest(), wheel.name) not in known:
            sys.exit(
                f"{wheel} is not the wheel of that name in {LOCK.name}: delete it, or, where a pin has changed, "
                "run python -m headless.lock_wheels"
            )


def download(folder: Path, requirements: list[str], python: str, tags: list[str]) -> bool:
    """Return whether pip had a wheel of each requirement for this Python and these tags."""
    pip = [sys.executable, "-m", "pip", "download", "-qq", "--no-deps", "--only-binary=:all:"]
    command = [*pip, f"--dest={folder}", f"--python-version={python}", *tags, *requirements]
    looking_for_pure = "--abi=none" in tags
    outcome = subprocess.run(  # noqa: S603  # pip, with our own pins
        command, check=False, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL if looking_for_pure else None
    )
    return outcome.returncode == 0


def stage(name: str, platform: str, wheels: list[Path]) -> Path:
    """Return a folder that holds what goes into the zip, the completed manifest included."""
    staged = STAGING / name / platform
    shutil.rmtree(staged, ignore_errors=True)
    (staged / "wheels").mkdir(parents=True)
    for content in CONTENTS:
        source = ROOT / content
        (staged / content).parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, staged / content, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy2(source, staged / content)
    for wheel in wheels:
        shutil.copy2(wheel, staged / "wheels" / wheel.name)
    (staged / "blender_manifest.toml").write_text(completed_manifest(name, platform, wheels), encoding="utf-8")
    return staged


def completed_manifest(name: str, platform: str, wheels: list[Path]) -> str:
    """Return the text of the manifest with the build of Blender, the platform and the wheels."""
    kept = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    build_of = BUILDS[name]
    added: dict[str, object] = {"blender_version_min": build_of.first}
    if build_of.limit:
        added["blender_version_max"] = build_of.limit
    added |= {"platforms": [platform], "wheels": [f"./wheels/{wheel.name}" for wheel in wheels]}
    lines = "".join(f"{key} = {json.dumps(value, indent=4)}\n" for key, value in added.items())
    top, permissions, rest = kept.partition("[permissions]")
    top = "".join(line for line in top.splitlines(keepends=True) if not line.startswith("blender_version_min"))
    return f"{top}{lines}\n{permissions}{rest}"


def blender_extension(*arguments: str) -> None:
    """Run Blender's own extension tool, which comes with the bpy module and needs no Blender."""
    package = importlib.util.find_spec("bpy")
    if package is None or package.origin is None:
        sys.exit("the extension tool comes with Blender's module, which is missing here: run make extension")
    tool = next(Path(package.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    outcome = subprocess.run(  # noqa: S603  # Blender's own tool
        [sys.executable, str(tool), *arguments], check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    if outcome.returncode != 0:
        sys.exit(f"Blender's extension tool refused to {arguments[0]}:\n{outcome.stdout}{outcome.stderr}")


if __name__ == "__main__":
    main(sys.argv[1:])
