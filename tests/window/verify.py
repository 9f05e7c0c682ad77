"""Verification, played by mouse and keyboard: a recording of installed sensors, what differs, and the corrected scene.

.ci/window BLENDER OUT tests/window/verify.py scenes/junction.blend
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import bpy
import numpy as np
from bl_ext.user_default.seip.seip_addon.session import session
from driver import Steps, Window, play

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.site.scene_geometry import Mesh
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors
from tests.builders.site_recording import changed, save_site_recording
from tests.builders.small_junction import box_triangles

OUT = Path(sys.argv[sys.argv.index("--") + 1])
GONE = "Building 1"
KIOSK = Mesh("kiosk", box_triangles((13.0, -14.0, 0.0), (16.0, -12.0, 4.0)))
SHIFT = np.array([0.3, -0.2, 0.1])
RUN = Path("scenes/junction_traffic/run-9.npz")


def scenario(window: Window) -> Steps:
    """Verify two sensors that are off their plan, show the picture, correct the scene and undo it."""
    recording = _recorded()
    yield from window.open_sidebar("SEIP")
    sections = _scene().seip.sections
    sections.site = sections.sensors = sections.placement = False
    yield from window.open_section("traffic")
    yield from window.open_section("verification")
    _scene().seip.verification.recording = str(recording)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo_push(message="Recording")  # as Blender does when a person changes a field
    yield from window.picture("1-ready")
    button = yield from window.find("seip.verify(")
    yield from window.press("LEFTMOUSE", button)
    yield 1.0
    stop = yield from window.beside(button, "seip.stop(")
    yield from window.shot("2-running")
    yield from window.press("LEFTMOUSE", stop)
    yield from window.until(lambda: session.running is None and not (OUT / "seip-result").exists(), 30)
    yield from window.click("seip.verify(")
    yield from window.until(lambda: session.running is None and session.verifications, 300)
    yield 1.0
    yield from window.picture("3-verified")
    yield from window.click("seip.correct_scene(")
    yield 1.0
    assert GONE not in _scene().objects
    assert "Found 1" in _scene().objects
    yield from window.picture("4-corrected")
    yield from window.press("Z", ctrl=True)
    yield 1.0
    assert GONE in _scene().objects
    assert "Found 1" not in _scene().objects
    yield from window.picture("5-undone")
    yield from window.click("seip.show_changes(")
    yield 2.0
    yield from window.shot("6-picture")


def _recorded() -> Path:
    """Put two sensors into the scene, save it, and simulate a recording of them at a site that has changed."""
    sensors = contract.find_or_make(_scene(), contract.SENSORS)
    for label, at in (("S1", (-8.75, 12.6, 5.5)), ("S2", (8.25, -11.3, 5.5))):
        empty = bpy.data.objects.new(label, None)
        empty["seip_sensor"], empty["seip_label"], empty.location = "os1_128", label, at
        sensors.objects.link(empty)
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT.resolve() / "site.blend"))
    geometry = read_scene(_scene()).geometry
    true = [replace(one, xyz=one.xyz + SHIFT) for one in read_sensors(_scene(), load_catalogue())]
    traffic = Trajectories.load(RUN).moved_to(geometry.origin)
    return save_site_recording(OUT.resolve() / "recording", changed(geometry, GONE, [KIOSK]), true, traffic, sweeps=16)


def _scene() -> bpy.types.Scene:
    return bpy.context.window_manager.windows[0].scene


play(scenario, Window(OUT))
