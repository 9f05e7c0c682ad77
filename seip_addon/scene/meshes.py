"""Solids of the core as Blender's meshes."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.geometry.solids import Solid
from .materials import material


def mesh_of(name: str, solid: Solid) -> bpy.types.Mesh:
    """Return a new mesh with the faces and materials of a solid."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(solid.vertices.tolist(), [], solid.faces)
    names = sorted(set(solid.materials))
    for each in names:
        mesh.materials.append(material(each))
    slots = np.array([names.index(each) for each in solid.materials], dtype=np.int32)
    mesh.polygons.foreach_set("material_index", slots)
    mesh.update()
    return mesh
