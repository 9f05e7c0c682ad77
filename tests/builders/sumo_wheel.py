"""Stand-ins for SUMO: programs that state a version, and a wheel that holds them."""

import stat
import zipfile
from pathlib import Path

from seip_addon.core.programs.sumo_installation import SUMO_VERSION


def write_programs(home: Path, version: str = SUMO_VERSION, script: str = "") -> None:
    """Write `sumo` and `netconvert` to the ``bin`` of a folder with ``data``, which state a version or run a script."""
    (home / "data").mkdir(parents=True)
    (home / "bin").mkdir()
    for name in ("sumo", "netconvert"):
        program = home / "bin" / name
        program.write_text(_program(name, version, script), encoding="utf-8")
        program.chmod(0o755)


def write_wheel(folder: Path, version: str = SUMO_VERSION, script: str = "") -> Path:
    """Write a wheel `eclipse-sumo` of a version, with the programs of `write_programs`, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    info = f"eclipse_sumo-{version}.dist-info"
    files = {
        "sumo/__init__.py": "",
        "sumo/data/typemap/osmNetconvert.typ.xml": "<types/>",
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: eclipse-sumo\nVersion: {version}\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    programs = {f"sumo/bin/{name}": _program(name, version, script) for name in ("sumo", "netconvert")}
    record = "".join(f"{name},,\n" for name in (*files, *programs, f"{info}/RECORD"))
    path = folder / f"eclipse_sumo-{version}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in {**files, f"{info}/RECORD": record}.items():
            archive.writestr(name, text)
        for name, text in programs.items():
            entry = zipfile.ZipInfo(name)
            entry.external_attr = (stat.S_IFREG | 0o755) << 16
            archive.writestr(entry, text)
    return path


def _program(name: str, version: str, script: str) -> str:
    return f"#!/bin/sh\n{script or f'echo Eclipse SUMO {name} {version}'}\n"
