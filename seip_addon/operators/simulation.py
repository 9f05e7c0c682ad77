"""Operators that install SUMO into the extension's own folder, and simulate runs of traffic at the site with it."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy

from .. import last_scan, preferences, scene_status
from ..core.errors import SeipError
from ..core.progress import Progress
from ..core.sensing.traffic.source import TrafficFiles
from ..core.sumo_installation import install_sumo
from ..core.sumo_programs import Sumo
from ..core.workflows.traffic_simulation import SimulatedRuns, simulate_runs
from ..properties.conversion import output_folder
from ..scene.read import read_scene
from ..session import SceneTraffic
from .base import Conditional, LongWork, Outcome
from .traffic import show_traffic


class SEIP_OT_install_sumo(Conditional, LongWork[Sumo], bpy.types.Operator):
    """Download Eclipse SUMO from PyPI into the extension's own folder, where it takes up to 470 MB. It lays out the streets of an extract of OpenStreetMap and simulates traffic"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.install_sumo"
    bl_label = "Install SUMO"
    bl_options = {"REGISTER"}  # nothing in the file changes
    stopped_message = "stopped; SUMO was not installed"

    obstacles = (lambda _: preferences.why_no_installation(),)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Outcome:
        """Start in the main window: work ends with its window, and that of the preferences is soon closed."""
        main = next((window for window in context.window_manager.windows if window.parent is None), context.window)
        with context.temp_override(window=main):
            return super().invoke(context, event)

    def prepare(self, _scene: bpy.types.Scene) -> Generator[Progress, None, Sumo]:
        """Take pip and the folder."""
        reason = preferences.why_no_installation()
        if reason:
            raise SeipError(reason)
        return install_sumo(preferences.pip(), preferences.own_sumo_folder())

    def conclude(self, _scene: bpy.types.Scene, _result: Sumo) -> None:
        """Report what is there now."""
        self.report({"INFO"}, preferences.sumo_status()[0])


NO_MAP = "There is no map to simulate traffic on: name the OpenDRIVE map (.xodr) that this site was built from."
_TEXT_MAP = "streets.net.xml"
"""Name for the map of a text whose own name is no name of a file."""


def why_no_simulation(scene: bpy.types.Scene) -> str:
    """Return why no traffic can be simulated; nothing where it can."""
    obstacle = scene_status.obstacle(scene)
    if obstacle:
        return obstacle
    if preferences.sumo() is None:
        return f"{preferences.NO_SUMO}."
    return "" if scene.seip.simulation.street_map() is not None else NO_MAP


class SEIP_OT_simulate_traffic(Conditional, LongWork[SimulatedRuns], bpy.types.Operator):
    """Simulate runs of traffic on the map of the site with SUMO, put the first on the road, and use all for Detection and for placements in traffic"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.simulate_traffic"
    bl_label = "Simulate Traffic"
    stopped_message = "stopped; no run was written"

    obstacles = (why_no_simulation,)

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SimulatedRuns]:
        """Read the road and the map."""
        request = scene.seip.simulation
        found = request.street_map()
        if found is None:
            raise SeipError(NO_MAP)
        self._named, self._key = request.folder, request.key()
        geometry = read_scene(scene).geometry
        more = (request.settings(), request.count, geometry, output_folder(request.folder, "the runs of traffic"))
        if isinstance(found, Path):
            return simulate_runs(found, *more, preferences.sumo_folders())
        return _simulated_on_text(found.name, found.as_string(), *more, preferences.sumo_folders())

    def conclude(self, scene: bpy.types.Scene, result: SimulatedRuns) -> None:
        """Put the first run on the road, and name the folder where runs are asked for."""
        seip = scene.seip
        first = str(result.paths[0])
        seip.traffic.file = bpy.path.relpath(first) if self._named.startswith("//") else first
        seip.detection.runs = seip.goal.runs = self._named
        seip.simulation.facts, seip.simulation.made_with = result.summary, self._key
        files = TrafficFiles(result.paths[0])
        show_traffic(scene, SceneTraffic(files, last_scan.changes(files), result.first), result.warnings[0])
        for sentence in result.messages:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{result.summary}; press play")


def _simulated_on_text(name: str, text: str, *more: Any) -> Generator[Progress, None, SimulatedRuns]:  # noqa: ANN401  # of `simulate_runs`
    """Simulate traffic on a map that is a text in the open file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / (Path(name).name or _TEXT_MAP)
        path.write_text(text, encoding="utf-8")
        return (yield from simulate_runs(path, *more))
