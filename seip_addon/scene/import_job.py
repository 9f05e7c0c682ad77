"""Imports a mesh file in a Blender of its own, which damaged files may crash; `imported.import_mesh` starts it.

blender -b --factory-startup --python-exit-code 1 -P import_job.py -- '["mesh.ply", "z", "meshes.blend", []]'
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

import bpy

MEMORY = 12 << 30  # bytes of address space, Blender's own included


def main(path: Path, up: str | None, output: Path, paths: list[str]) -> None:
    """Import a file into an empty scene and write its meshes, or what is wrong with them as a text next to these.

    Parameters
    ----------
    up : str or None
        Axis of the file that points up, where it is given.
    paths : list of str
        Where the Python of the process that asks finds its packages: no extension is installed here.
    """
    if sys.platform != "win32":
        import resource  # noqa: PLC0415  # not on Windows

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    package = Path(__file__).resolve().parents[1]
    sys.path[:] = [str(package.parent), *paths]
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    imported = import_module(f"{package.name}.scene.imported")
    try:
        meshes = imported.imported_meshes(path, up)
    except imported.SeipError as error:
        output.with_suffix(".txt").write_text(str(error), encoding="utf-8")
    else:
        bpy.data.libraries.write(str(output), set(meshes))


if __name__ == "__main__":
    mesh, axis, meshes, packages = json.loads(sys.argv[sys.argv.index("--") + 1])
    main(Path(mesh), axis, Path(meshes), packages)
