"""Meshes out of files that Blender's own importers read, as occluders of a scene."""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from mathutils import Matrix

from ..core.child_process import exit_status
from ..core.errors import SeipError
from ..core.limits import MODEL_COORDINATE
from ..core.site.scene_geometry import FROM_MESH
from ..core.world.streetscape.mesh_header import check_mesh_header
from ..core.world.streetscape.mesh_place import MeshPlace
from . import contract
from .read import shown_parts

MAX_FACES = 2_000_000
UP_AXES = ("y", "z")
WITHOUT_AXES = (".obj", ".ply", ".stl")
"""Files that do not name the axis that points up."""
IMPORT_SECONDS = 300.0  # for an import in a process of its own
_FORWARD = {"y": "NEGATIVE_Z", "z": "Y"}


def _gltf(path: str, _: str | None) -> None:
    if "gltf" not in dir(bpy.ops.import_scene):
        addon_utils.enable("io_scene_gltf2")
    bpy.ops.import_scene.gltf(filepath=path)


def _with_axes(operator: Callable[..., object]) -> Callable[[str, str | None], None]:
    def read(path: str, up: str | None) -> None:
        axes = {} if up is None else {"up_axis": up.upper(), "forward_axis": _FORWARD[up]}
        operator(filepath=path, **axes)

    return read


def _usd(path: str, _: str | None) -> None:
    bpy.ops.wm.usd_import(filepath=path, import_cameras=False, import_lights=False, set_frame_range=False)


IMPORTERS: dict[str, Callable[[str, str | None], None]] = {
    **dict.fromkeys((".glb", ".gltf"), _gltf),
    ".obj": _with_axes(bpy.ops.wm.obj_import),
    ".ply": _with_axes(bpy.ops.wm.ply_import),
    ".stl": _with_axes(bpy.ops.wm.stl_import),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), _usd),
}
"""Blender's importers by what the names of files end in; each takes a path and the axis that points up, if given."""


@dataclass(frozen=True)
class MeshFiles:
    """Files of meshes with one origin.

    Parameters
    ----------
    paths : tuple of Path
    origin : tuple of float
        Position of their zero, as for `mesh_place`.
    up : str, optional
        Axis that points up in files that do not name it, `UP_AXES`.
    """

    paths: tuple[Path, ...]
    origin: tuple[float, ...]
    up: str | None = None

    def up_of(self, path: Path) -> str | None:
        """Return the axis that points up in a file, or None if it names the axis itself or the default holds."""
        return self.up if path.suffix.lower() in WITHOUT_AXES else None


def meshes_in(folder: Path) -> tuple[Path, ...]:
    """Return the files with meshes in a folder, by name.

    Raises
    ------
    SeipError
        There is none.
    """
    found = sorted(path for path in folder.glob("*") if path.suffix.lower() in IMPORTERS)
    if not found:
        raise SeipError(f"{folder} has no file with a mesh ({', '.join(sorted(IMPORTERS))}): choose another folder")
    return tuple(found)


def check_mesh(path: Path, up: str | None = None) -> None:
    """Check that a file is there and of a kind that is read, before a scene is built.

    Raises
    ------
    SeipError
        It is not, names its own axes where others are given, or as for `check_mesh_header`.
    """
    if not path.is_file():
        raise SeipError(f"no such file: {path}; check its path")
    kind = path.suffix.lower()
    if kind not in IMPORTERS:
        raise SeipError(f"{path.name} is of no kind that is imported: {', '.join(sorted(IMPORTERS))}; convert it")
    if up is not None and kind not in WITHOUT_AXES:
        raise SeipError(f"{path.name} says itself which axis points up: leave out --mesh-up")
    check_mesh_header(path)


def import_mesh(
    scene: bpy.types.Scene, path: Path, place: MeshPlace, up: str | None = None
) -> list[tuple[str, str, bool]]:
    """Add the meshes of a file to the occluders of the open scene.

    Parameters
    ----------
    place : MeshPlace
        Where its zero stands.
    up : str, optional
        Axis of the file that points up, `UP_AXES`; by default as Blender takes it.

    Returns
    -------
    list of (name, source, height assumed)
        What was added, as `core.site.sources` counts it.

    Raises
    ------
    SeipError
        The file cannot be imported, holds no face, too many, faulty ones, or its coordinates are far from its zero.
    """
    check_mesh(path, up)
    meshes = _imported_apart(path, up)
    into = contract.find_or_make(scene, contract.OCCLUDERS)
    matrix = Matrix.Translation(place.position) @ Matrix.Rotation(place.heading, 4, "Z")
    objects = set()
    for mesh in meshes:
        obj = bpy.data.objects.new(path.stem, mesh)
        obj.matrix_world = matrix
        obj[contract.SOURCE], obj[contract.BUILT] = FROM_MESH, True
        into.objects.link(obj)
        objects.add(obj)
    for part in shown_parts(scene, {contract.OCCLUDERS: objects}):
        if part.fault:
            raise SeipError(f"{path.name}: {part.fault}")
    return [(f"Mesh {path.stem}", FROM_MESH, False)] * len(objects)


def imported_meshes(path: Path, up: str | None = None) -> list[bpy.types.Mesh]:
    """Import a file into the open scene and return its meshes about the zero of the file, without their objects.

    Raises
    ------
    SeipError
        As for `import_mesh`.
    """
    before = set(bpy.data.objects)
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # where importers tell of every mesh
            IMPORTERS[path.suffix.lower()](str(path.resolve()), up)
    except Exception as error:  # importers raise whatever a broken file makes them
        first = (str(error).strip().splitlines() or ["no reason given"])[-1]
        raise SeipError(f"Blender cannot import {path.name}: {first[:160]}; write the file again") from error
    made = [obj for obj in bpy.data.objects if obj not in before]
    for mesh in {obj.data for obj in made if obj.type == "MESH"}:
        mesh.validate()  # faces of vertices that are not there, which would end the process later on
    meshes = _own_meshes(made, path)
    for obj in made:
        bpy.data.objects.remove(obj)
    return meshes


def _imported_apart(path: Path, up: str | None) -> list[bpy.types.Mesh]:
    """Import a file as `imported_meshes` does, in a Blender of its own: damaged files crash importers.

    Raises
    ------
    SeipError
        As for `import_mesh`; or that Blender crashed or did not come to an end.
    """
    script = str(Path(__file__).with_name("import_job.py"))
    if bpy.app.binary_path:
        start = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "-P", script]
    else:
        start = [sys.executable, script]
    with tempfile.TemporaryDirectory(prefix="seip-") as folder:
        output = Path(folder) / "meshes.blend"
        try:
            command = [*start, "--", json.dumps([str(path.resolve()), up, str(output), sys.path])]
            status = exit_status(command, IMPORT_SECONDS)
        except OSError as error:
            raise SeipError(f"Blender cannot be started to import {path.name}: {error.strerror or error}") from error
        if status is None:
            raise SeipError(f"Blender takes more than {IMPORT_SECONDS:g} s to import {path.name}: simplify the mesh")
        if output.with_suffix(".txt").is_file():
            raise SeipError(output.with_suffix(".txt").read_text(encoding="utf-8"))
        if status != 0 or not output.is_file():
            raise SeipError(f"Blender crashes when it imports {path.name}: the file is damaged, write it again")
        with bpy.data.libraries.load(str(output)) as (there, here):
            here.meshes = there.meshes
        return list(here.meshes)


def _own_meshes(made: list[bpy.types.Object], path: Path) -> list[bpy.types.Mesh]:
    """Return what objects show as meshes of their own about the zero of the file."""
    layer = bpy.context.view_layer
    layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = []
    for obj in made:
        if obj.type != "MESH" or not len(obj.data.polygons):
            continue
        mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)
        mesh.transform(obj.matrix_world)
        meshes.append(mesh)
    faces = sum(len(mesh.polygons) for mesh in meshes)
    if not faces:
        raise SeipError(f"{path.name} holds no face: export surfaces, not points or curves")
    if faces > MAX_FACES:
        raise SeipError(
            f"{path.name} holds {faces:,} faces, more than {MAX_FACES:,}: simplify it (Blender's Decimate), a tenth of "
            "a metre is fine enough"
        )
    far = max(_farthest(mesh) for mesh in meshes)
    if not MODEL_COORDINATE.allow(far):
        raise SeipError(
            f"{path.name} has vertices {far:,.0f} m from its zero, where 32 bits are too coarse: move its zero to the "
            "place (or set its units to metres)"
        )
    return meshes


def _farthest(mesh: bpy.types.Mesh) -> float:
    """Return the greatest coordinate of a mesh in plan or height, metres; what is no number does not count."""
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    return float(np.abs(places[np.isfinite(places)]).max(initial=0.0))
