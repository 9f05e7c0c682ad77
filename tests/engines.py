"""The ray-casting engines that are there to be tested."""

from __future__ import annotations

import importlib.util

import pytest

from seip_addon.core.sensing.visibility.settings import Engine

try:
    import bpy  # noqa: F401 - brings mathutils
except ImportError:
    HAS_BVH = False
else:
    HAS_BVH = True
HAS_EMBREE = importlib.util.find_spec("embreex") is not None

ANY: Engine = "bvh" if HAS_BVH else "embree"
needs_bvh = pytest.mark.skipif(not HAS_BVH, reason="Blender's BVH tree comes with bpy")
needs_embree = pytest.mark.skipif(not HAS_EMBREE, reason="embreex is not installed")
needs_any = pytest.mark.skipif(not (HAS_BVH or HAS_EMBREE), reason="neither bpy nor embreex is installed")
each_engine = pytest.mark.parametrize(
    "engine", [pytest.param("bvh", marks=needs_bvh), pytest.param("embree", marks=needs_embree)]
)
