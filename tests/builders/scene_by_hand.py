"""A Blender scene made of a `SceneGeometry`, as a person would model it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np
import shapely

from seip_addon.scene import contract
from seip_addon.scene.materials import nodes_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry


def make_scene(geometry: SceneGeometry) -> bpy.types.Scene:
    """Return the scene of a fresh file, filled by the scene contract."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.name = geometry.name
    scene["seip_origin"] = geometry.origin.tolist()
    _fill(scene, contract.ROADS, geometry.roads, (0.25, 0.25, 0.27))
    _fill(scene, contract.GROUND, geometry.ground, (0.55, 0.53, 0.5))
    _fill(scene, contract.OCCLUDERS, geometry.occluders, (0.6, 0.55, 0.5))
    triangles = [
        np.array(part.exterior.coords)[:3] for part in shapely.get_parts(shapely.delaunay_triangles(geometry.region))
    ]
    flat = np.array([[(x, y, 0.5) for x, y in triangle] for triangle in triangles])
    collection = contract.find_or_make(scene, contract.REGION)
    collection.objects.link(_object("region", flat, (1.0, 0.0, 0.0)))
    return scene


def _fill(scene: bpy.types.Scene, name: str, meshes: Iterable[Mesh], colour: tuple[float, float, float]) -> None:
    collection = contract.find_or_make(scene, name)
    for mesh in meshes:
        collection.objects.link(_object(mesh.name, mesh.triangles, colour))


def _object(name: str, triangles: np.ndarray, colour: tuple[float, float, float]) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(triangles.reshape(-1, 3).tolist(), [], np.arange(3 * len(triangles)).reshape(-1, 3).tolist())
    material = bpy.data.materials.get(f"{colour}") or bpy.data.materials.new(f"{colour}")
    material.diffuse_color = (*colour, 1.0)
    for node in nodes_of(material):
        if node.type == "BSDF_PRINCIPLED":
            node.inputs["Base Color"].default_value = (*colour, 1.0)
    mesh.materials.append(material)
    return bpy.data.objects.new(name, mesh)
