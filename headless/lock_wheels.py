"""Write `wheels.lock`: the SHA-256 of each wheel that a pin of ``pyproject.toml`` stands for.

    python -m headless.lock_wheels

pip names the wheel that it would take for each pin, Python and platform, and its digest; packages are installed, and
wheels bundled in the extension, only where they are these. To be run after a pin has changed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote, urlsplit

from headless.build_extension import BUILDS, WHEEL_TAGS
from headless.set_up import LOCK, SUPPORTED_PYTHONS, UNLOCKED, requirements

from packaging.requirements import Requirement

GROUPS = ("installer", "development", "traffic", "detection", "second-opinion")
"""Groups that `headless.set_up` installs; the group ``readers`` is tried out apart from the rest."""

MAX_GLIBC_MINOR = 36  # of Debian 12, the oldest system that is tried: 2.36


def main() -> None:
    """Ask pip for the wheels of all pins and write the lock."""
    everything = sorted({pin for group in GROUPS for pin in requirements(group) if pin.split("==")[0] not in UNLOCKED})
    linux = [f"manylinux_2_{minor}_x86_64" for minor in range(MAX_GLIBC_MINOR, 4, -1)]
    found: dict[str, str] = {}
    for version in SUPPORTED_PYTHONS:
        found |= wheels(everything, "{}.{}".format(*version), linux)
    for pin in requirements("extension"):  # the extension carries wheels without compiled code where there are any
        found |= wheels([pin], BUILDS["blender4.5"].python, ["any"], pure=True)
    for build in BUILDS.values():
        for platform in build.platforms:
            found |= wheels(requirements("extension"), build.python, list(WHEEL_TAGS[platform]))
    LOCK.write_text("".join(f"{found[name]}  {name}\n" for name in sorted(found)), encoding="utf-8")
    sys.stdout.write(f"{LOCK.name}: {len(found)} wheels\n")


def wheels(wanted: list[str], python: str, platforms: list[str], *, pure: bool = False) -> dict[str, str]:
    """Return the digests of the wheels that pip takes for a Python and platform, by their names.

    There may be no ``pure`` wheels, those without compiled code.
    """
    fitting = [
        f"{pin.name}{pin.specifier}"
        for pin in map(Requirement, wanted)
        if pin.marker is None or pin.marker.evaluate({"python_version": python})
    ]
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [
            *(sys.executable, "-m", "pip", "install", "--dry-run", "-qq", "--ignore-installed", "--no-deps"),
            *("--only-binary", ":all:", "--target", folder, "--python-version", python, "--report", str(report)),
            *(f"--platform={platform}" for platform in platforms),
            *(["--abi=none"] if pure else []),
            *fitting,
        ]
        hidden = subprocess.DEVNULL if pure else None
        outcome = subprocess.run(command, check=False, stdin=subprocess.DEVNULL, stderr=hidden)  # noqa: S603  # pip, our pins
        if outcome.returncode != 0 and pure:
            return {}
        if outcome.returncode != 0:
            sys.exit(f"pip finds no wheels for Python {python} on {platforms[0]}: see its message above")
        installed = json.loads(report.read_text(encoding="utf-8"))["install"]
    sources = [package["download_info"] for package in installed]
    return {
        unquote(Path(urlsplit(source["url"]).path).name): source["archive_info"]["hashes"]["sha256"]
        for source in sources
    }


if __name__ == "__main__":
    main()
