"""Build the Blender extension: the add-on with the wheels of all it imports, one zip for each platform.

    python -m headless.build_extension --platforms linux-x64 windows-x64 macos-arm64

The wheels are the group ``extension`` of the pins in ``pyproject.toml``, in
`wheels/`, checked against ``wheels.lock``; each zip serves every Python that a supported Blender runs on.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from headless.set_up import LOCK

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "wheels"
STAGING = ROOT / "build" / "extension"
CONTENTS = ("__init__.py", "LICENSE", "seip_addon")

PYTHONS = ("3.11", "3.13", "3.14")
"""Blender 4.5 LTS; Blender 5.1 and later; Blender 5.2 as Debian builds it."""

WHEEL_TAGS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_14_0_arm64",),
}
"""Wheel tags by Blender's name of a platform: no newer system than Blender itself asks for."""


def main(arguments: list[str]) -> None:
    """Build and check one zip for each of the platforms asked for."""
    parser = argparse.ArgumentParser(prog="build_extension", description="Build the Blender extension into dist/.")
    parser.add_argument("--platforms", nargs="+", choices=WHEEL_TAGS, default=["linux-x64"])
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder of the zips (default: dist)")
    options = parser.parse_args(arguments)
    for platform in options.platforms:
        print(build(platform, options.output))  # noqa: T201  # a command's output


def build(platform: str, output: Path) -> Path:
    """Return the finished zip for a platform, validated by Blender's own tool."""
    wheels = fetch_wheels(platform)
    staged = stage(platform, wheels)
    output.mkdir(parents=True, exist_ok=True)
    target = output.resolve() / f"seip-{manifest()['version']}-{platform.replace('-', '_')}.zip"
    blender_extension("build", "--source-dir", str(staged), "--output-filepath", str(target))
    blender_extension("validate", str(target))
    return target


def pins() -> list[str]:
    """Return the requirements whose wheels the extension carries."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
    return list(groups["extension"])


def manifest() -> dict[str, object]:
    """Return the manifest as it is kept, without platforms and wheels."""
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def fetch_wheels(platform: str) -> list[Path]:
    """Return the wheels for a platform, downloaded when the pins have changed since the last time.

    A wheel without compiled code serves all Pythons; for the other pins there
    is one for each.
    """
    folder = WHEELS / platform
    stamp = folder / "pins.json"
    wanted = json.dumps({"pins": pins(), "pythons": PYTHONS, "tags": WHEEL_TAGS[platform]})
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != wanted:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        tags = [f"--platform={tag}" for tag in WHEEL_TAGS[platform]]
        compiled = [pin for pin in pins() if not download(folder, [pin], PYTHONS[0], ["--platform=any", "--abi=none"])]
        for python in PYTHONS:
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
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
    command = [*pip, f"--dest={folder}", f"--python-version={python}", *tags, *requirements]
    looking_for_pure = "--abi=none" in tags
    outcome = subprocess.run(  # noqa: S603  # pip, with our own pins
        command, check=False, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL if looking_for_pure else None
    )
    return outcome.returncode == 0


def stage(platform: str, wheels: list[Path]) -> Path:
    """Return a folder that holds what goes into the zip, the completed manifest included."""
    staged = STAGING / platform
    shutil.rmtree(staged, ignore_errors=True)
    (staged / "wheels").mkdir(parents=True)
    for name in CONTENTS:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, staged / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy2(source, staged / name)
    for wheel in wheels:
        shutil.copy2(wheel, staged / "wheels" / wheel.name)
    kept = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    top, permissions, rest = kept.partition("[permissions]")
    lists = {"platforms": [platform], "wheels": [f"./wheels/{wheel.name}" for wheel in wheels]}
    added = "".join(f"{key} = {json.dumps(values, indent=4)}\n" for key, values in lists.items())
    (staged / "blender_manifest.toml").write_text(f"{top}{added}\n{permissions}{rest}", encoding="utf-8")
    return staged


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
