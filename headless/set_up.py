"""Set up a virtual environment with everything that the commands and the tests need.

    python3 -m headless.set_up .venv
    python3 -m headless.set_up .venv traffic  # and a group of packages more

It does nothing when the environment is there and the pins in ``pyproject.toml`` have not changed. pip takes no package
whose digest is not in ``wheels.lock``, except `UNLOCKED`. It runs under any Python 3, so that one of the wrong version
gets a sentence and no traceback.
"""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from headless.system_libraries import SUMO_PACKAGES, complaint, missing_libraries

SUPPORTED_PYTHONS = ((3, 11), (3, 13))
ROOT = Path(__file__).resolve().parent.parent
LOCK = ROOT / "wheels.lock"

UNLOCKED = {"torch"}
"""Packages of many builds, of which pip's settings choose: those for graphics cards bring packages of their own."""

SEPARATE_GROUPS = {"second-opinion"}  # groups of packages that ask for others which are not used here


def main(arguments: list[str]) -> str | None:
    """Set up the environment in the folder named first, with the groups named after it; return what went wrong."""
    if not arguments:
        return "usage: python3 -m headless.set_up FOLDER [GROUP ...]"
    environment = Path(arguments[0])
    trouble = what_is_missing(sumo="traffic" in arguments[1:])
    if trouble:
        return trouble
    stamp = environment / "set-up"
    wanted = fingerprint()
    if not stamp.is_file() or stamp.read_text() != wanted:
        install(environment)
        stamp.write_text(wanted)
    write_command(environment)
    for group in arguments[1:]:
        install_group(environment, group)
    return None


def what_is_missing(*, sumo: bool = False) -> str | None:
    """Return what this system lacks, with its cure, before anything is downloaded."""
    if sys.version_info[:2] not in SUPPORTED_PYTHONS:
        return (
            f"this is Python {sys.version_info[0]}.{sys.version_info[1]}, but Blender's module exists "
            "for Python 3.11 and 3.13 only; use one of these: make PYTHON=python3.13 ..."
        )
    missing = missing_libraries() | (missing_libraries(SUMO_PACKAGES) if sumo else {})
    if importlib.util.find_spec("ensurepip") is None:
        missing = {"the module ensurepip": "python3-venv", **missing}
    return complaint(missing) if missing else None


def dependency_groups() -> dict[str, list[Any]]:
    """Return the pins of ``pyproject.toml`` by group."""
    import tomllib  # noqa: PLC0415  # Python 3.10 has none, and must get as far as its sentence

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    groups: dict[str, list[Any]] = project["dependency-groups"]
    return groups


def requirements(group: str) -> list[str]:
    """Return the pins of a group, and of those that it includes."""
    pins: list[str] = []
    for pin in dependency_groups()[group]:
        pins += requirements(pin["include-group"]) if isinstance(pin, dict) else [pin]
    return pins


def locked_hashes() -> dict[tuple[str, str], list[str]]:
    """Return the digests of all wheels by name and version, without what a build adds to the version."""
    hashes: dict[tuple[str, str], list[str]] = {}
    for line in LOCK.read_text(encoding="utf-8").splitlines():
        sha256, file = line.split()
        name, version = file.split("-")[:2]
        hashes.setdefault((canonical(name), version.split("+")[0]), []).append(sha256)
    return hashes


def locked(pins: list[str]) -> list[str]:
    """Return pins as lines of a requirements file, each with the digests that pip may take for it."""
    hashes = locked_hashes()
    lines = []
    for pin in pins:
        name, version = pin.split(";")[0].strip().split("==")
        allowed = hashes.get((canonical(name), version), [])
        if not allowed:
            sys.exit(f"{LOCK.name} holds no wheel of {name} {version}: run python -m headless.lock_wheels")
        lines.append(" ".join([pin, *(f"--hash=sha256:{sha256}" for sha256 in sorted(set(allowed)))]))
    return lines


def canonical(name: str) -> str:
    """Return the name of a package as it is compared (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def fingerprint() -> str:
    """Return what an environment depends on: this Python, the pins and their digests."""
    lock = LOCK.read_text(encoding="utf-8")
    return json.dumps(
        {"python": sys.version, "base": sys.base_prefix, "groups": dependency_groups(), "lock": lock}, indent=1
    )


def install(environment: Path) -> None:
    """Create the environment and install the pinned packages, Blender's module (370 MB) among them."""
    print(f"setting up {environment} (a few minutes the first time)", flush=True)  # noqa: T201  # a command's output
    if environment.exists():
        if not (environment / "pyvenv.cfg").is_file():
            sys.exit(f"{environment} exists and is not a virtual environment; name another: make VENV=.venv ...")
        shutil.rmtree(environment)
    run(sys.executable, "-m", "venv", str(environment))
    for group in ("installer", "development"):
        install_group(environment, group)
    run(str(environment / "bin" / "python"), "-c", "import bpy")


def write_command(environment: Path) -> None:
    """Write the command ``seip`` of this checkout into the environment."""
    python = environment.resolve() / "bin" / "python"
    program = f"import sys; sys.path[0] = {str(ROOT)!r}; from headless.__main__ import main; main()"
    command = python.with_name("seip")
    command.write_text(f'#!/bin/sh\nexec {shlex.quote(str(python))} -c {shlex.quote(program)} "$@"\n', encoding="utf-8")
    command.chmod(0o755)


def install_group(environment: Path, group: str) -> None:
    """Install the packages of a group, those of the lock first."""
    pip = [str(environment / "bin" / "python"), "-m", "pip", "install", "-qq", "--only-binary", ":all:"]
    pip += ["--no-deps"] if group in SEPARATE_GROUPS else []
    pins = requirements(group)
    free = [pin for pin in pins if pin.split("==")[0] in UNLOCKED]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "requirements.txt"
        file.write_text("\n".join(locked([pin for pin in pins if pin not in free])), encoding="utf-8")
        run(*pip, "--require-hashes", "-r", str(file))
    if free:
        run(*pip, *free)


def run(*command: str) -> None:
    """Run a command in the root of the checkout, and end with one sentence when it fails."""
    outcome = subprocess.run(command, cwd=ROOT, check=False)  # noqa: S603  # our own commands
    if outcome.returncode != 0:
        sys.exit(f"set-up stopped: {' '.join(command)} failed (see above)")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit("set-up stopped; the next run starts again")
