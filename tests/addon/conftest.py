"""The add-on as Blender registers it, on a fresh file, with a cache of its own."""

import bpy
import pytest

import seip_addon
from seip_addon import preferences


@pytest.fixture
def add_on(tmp_path, monkeypatch):
    """Register the add-on for one test, and see that it leaves nothing behind."""
    monkeypatch.setattr(preferences, "cache_folder", lambda: tmp_path / "cache")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    before = set(dir(bpy.types))
    seip_addon.register()
    yield
    seip_addon.unregister()
    assert set(dir(bpy.types)) == before
    assert not hasattr(bpy.types.Scene, "seip")
