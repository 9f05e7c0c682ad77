"""Set up a virtual environment with everything that the commands and the tests need.

    python3 -m headless.set_up .venv

It does nothing when the environment is there and the pins in ``pyproject.toml``
have not changed. It runs under any Python 3, so that one of the wrong version
gets a sentence and no traceback.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

from headless.system_libraries import complaint, missing_libraries

SUPPORTED = ((3, 11), (3, 13))
ROOT = Path(__file__).resolve().parent.parent


def main(arguments: list[str]) -> str | None:
    """Set up the environment in the folder named by the only argument; return what went wrong."""
    if len(arguments) != 1:
        return "usage: python3 -m headless.set_up FOLDER"
    environment = Path(arguments[0])
    trouble = what_is_missing()
    if trouble:
        return trouble
    stamp = environment / "set-up"
    wanted = fingerprint()
    if not stamp.is_file() or stamp.read_text() != wanted:
        install(environment)
        stamp.write_text(wanted)
    return None


def what_is_missing() -> str | None:
    """Return what this system lacks, with its cure, before anything is downloaded."""
    if sys.version_info[:2] not in SUPPORTED:
        return (
            f"this is Python {sys.version_info[0]}.{sys.version_info[1]}, but Blender's module exists for 3.11 and "
            "3.13 alone; name one of these: make PYTHON=python3.13 ..."
        )
    missing = missing_libraries()
    if importlib.util.find_spec("ensurepip") is None:
        missing = {"the module ensurepip": "python3-venv", **missing}
    return complaint(missing) if missing else None


def dependency_groups() -> dict[str, list[str]]:
    """Return the pins of ``pyproject.toml`` by group."""
    import tomllib  # noqa: PLC0415  # Python 3.10 has none, and must get as far as its sentence

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    groups: dict[str, list[str]] = project["dependency-groups"]
    return groups


def fingerprint() -> str:
    """Return what an environment depends on: this Python and the pins."""
    return json.dumps({"python": sys.version, "base": sys.base_prefix, "groups": dependency_groups()}, indent=1)


def install(environment: Path) -> None:
    """Make the environment anew and install the pinned packages, Blender's module (370 MB) among them."""
    print(f"setting up {environment} (a few minutes the first time)", flush=True)  # noqa: T201  # a command's output
    if environment.exists():
        if not (environment / "pyvenv.cfg").is_file():
            sys.exit(f"{environment} is there already and no virtual environment; name another: make VENV=.venv ...")
        shutil.rmtree(environment)
    run(sys.executable, "-m", "venv", str(environment))
    python = str(environment / "bin" / "python")
    run(python, "-m", "pip", "install", "--quiet", *dependency_groups()["installer"])
    run(python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", "--group", "development")
    run(python, "-c", "import bpy")


def run(*command: str) -> None:
    """Run a command in the root of the checkout, and end with one sentence when it fails."""
    outcome = subprocess.run(command, cwd=ROOT, check=False)  # noqa: S603  # our own commands
    if outcome.returncode != 0:
        sys.exit(f"set-up stopped: {' '.join(command)} failed (see above)")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit("set-up stopped; the next run starts it anew")
