"""The add-on as Blender registers it, on a fresh file, with a cache of its own."""

from types import SimpleNamespace

import bpy
import pytest

import seip_addon
from seip_addon.panel import preferences, sensors


@pytest.fixture
def add_on(tmp_path, monkeypatch):
    """Register the add-on for one test, and see that it leaves nothing behind."""
    monkeypatch.setattr(preferences, "cache_folder", lambda: tmp_path / "cache")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    before = set(dir(bpy.types))
    seip_addon.register()
    yield
    seip_addon.unregister()
    assert set(dir(bpy.types)) == before
    assert not hasattr(bpy.types.Scene, "seip")


@pytest.fixture
def scene(add_on):
    return bpy.context.scene


@pytest.fixture
def junction(add_on, small_scene):
    """The small junction, open, with settings under which several sensors of one type are worth placing."""
    bpy.ops.wm.open_mainfile(filepath=str(small_scene))
    scene = bpy.context.scene
    scene.seip.survey.heights = "8"
    scene.seip.survey.grid = 4.0
    scene.seip.survey.spacing = 12.0
    scene.seip.goal.count = 2
    sensors.refresh()
    for one in scene.seip.survey.types:
        one.use = one.name == "type1"
    return scene


@pytest.fixture
def placed(junction):
    """The small junction with sensors."""
    bpy.ops.seip.solve_placement()
    return junction


@pytest.fixture
def online(monkeypatch):
    """Let the preferences find that Blender may go online, and return a function that changes this."""

    def allow(allowed):
        app = SimpleNamespace(online_access=allowed, python_args=(), background=True)
        monkeypatch.setattr(preferences, "bpy", SimpleNamespace(**{**vars(bpy), "app": app}))

    allow(True)
    return allow
