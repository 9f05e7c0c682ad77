"""Traffic on the road: trajectories read from files and animated, or objects that are animated in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ..core.base.counts import counted
from ..core.output.datasets.formats import FORMATS
from ..core.output.datasets.sample import SPLITS
from ..core.sensing.scans.simulation import ScanSettings
from ..core.sensing.traffic.source import TrafficFiles, describe_categories, load_traffic
from ..core.sensing.traffic.trajectories import Trajectories
from ..core.workflows.recording import RecordingSettings
from ..scene import contract
from ..scene.read import read_scene
from ..scene.traffic import animate, clear_traffic
from . import scans, scene_status
from .layout import draw_path, draw_reason, draw_run, draw_sentence
from .properties import absolute, as_typed, of_setting, path_property
from .work import Job, LongWork, ShortWork

EXAMPLE = "Example"
"""In place of a traffic file: the traffic of the example, which is at another path on every machine."""
EXAMPLES = Path(__file__).resolve().parents[2] / "scenes"
"""Folder of the example: beside the package, in a checkout as in the extension."""
EXAMPLE_RUN, EXAMPLE_MAP = EXAMPLES / "junction_traffic" / "run-1.npz", EXAMPLES / "junction.xodr"
NO_FILE = "There is no traffic file: name one, or animate objects of your own in SEIP Traffic."


class SEIP_PG_traffic(bpy.types.PropertyGroup):
    """Source of the traffic, and settings of its scans."""

    file: path_property(
        "Traffic",
        "Trajectories (.npz) or floating car data of SUMO (.xml, .csv, packed or not); "
        f"{EXAMPLE} for the traffic of the example; empty for objects that are animated in the scene",
    )
    routes: path_property("Routes", "SUMO file with the vehicle types and their sizes")
    net: path_property("Network", "SUMO network (.net.xml) with the offset from the map")
    runs: path_property(
        "Runs",
        "Folder with runs of traffic (.npz): two or more to place sensors in traffic, of which the last third is for "
        "evaluation, and four or more for an interval of detection. Empty for the folder SCENE_traffic beside the file",
        folder=True,
    )
    loaded: StringProperty(name="Loaded", description="Content of the file, one fact a line")
    seed: of_setting(ScanSettings, "seed", "Seed")
    noise: BoolProperty(
        name="Noise", description="Noisy ranges and lost returns, as in the sensors' data sheets", default=True
    )
    rolling_shutter: of_setting(ScanSettings, "rolling_shutter", "Rolling Shutter")
    whole: BoolProperty(name="Whole Run", description="Scan the whole run", default=True)
    start: FloatProperty(
        name="Start",
        description="Time of the first frame, in seconds",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        min=0.0,
    )
    duration: FloatProperty(
        name="Duration",
        description="Time from the first to the last frame, in seconds",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        default=10.0,
        min=0.0,
    )
    rate: FloatProperty(
        name="Rate (Hz)",
        description="Frames per second; 0 for the rotation rate of the slowest sensor",
        default=0.0,
        min=0.0,
        soft_max=20.0,
        step=100,
    )
    folder: path_property(
        "Folder",
        "Output folder for frames and datasets; an interrupted run resumes there",
        folder=True,
        default="//scans",
    )
    formats: EnumProperty(
        name="Formats",
        description="Datasets to write beside the frames",
        items=tuple((key, kind.name, f"Write the dataset as {kind.name}") for key, kind in FORMATS.items()),
        options={"ENUM_FLAG"},
        default={"openpcdet"},
    )
    split: EnumProperty(
        name="Split",
        description="Split of the dataset for the whole run",
        items=tuple((split, split.capitalize(), f"The run belongs to the split {split!r}") for split in SPLITS),
    )

    def files(self) -> TrafficFiles | None:
        """Return the files that traffic is read from, None where it is animated in the scene."""
        if not self.file:
            return None
        if self.file == EXAMPLE:
            return TrafficFiles(EXAMPLE_RUN)
        routes = (absolute(self.routes),) if self.routes else ()
        return TrafficFiles(absolute(self.file), routes, absolute(self.net) if self.net else None)

    def recording(self) -> RecordingSettings:
        """Return the settings of scans as the core takes them."""
        return RecordingSettings(
            scan=ScanSettings(self.seed, self.noise, self.rolling_shutter),
            start=None if self.whole else as_typed(self.start),
            duration=None if self.whole else as_typed(self.duration),
            rate=as_typed(self.rate) or None,
            formats=tuple(key for key in FORMATS if key in self.formats),
            split=self.split,
        )


def why_no_load(scene: bpy.types.Scene) -> str:
    """Return why no traffic can be loaded; nothing where it can."""
    return scene_status.not_own(scene) or ("" if scene.seip.traffic.file else NO_FILE)


class SEIP_OT_load_traffic(LongWork, bpy.types.Operator):
    """Read the traffic file and animate its road users on the road"""

    obstacles = (why_no_load,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the traffic onto the scene, and animate its road users."""
        scene, result = yield load_traffic(scene.seip.traffic.files(), read_scene(scene).geometry)
        show_traffic(scene, result.trajectories, result.warnings)
        for sentence in result.warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(result.trajectories), 'road user')}; press play")


def show_traffic(scene: bpy.types.Scene, trajectories: Trajectories, warnings: Sequence[str]) -> None:
    """Animate road users read from files, in place of earlier ones and of their scan, and note what there is."""
    animate(scene, trajectories)
    scans.forget_scan(scene)
    begin, end = trajectories.span
    users = f"{counted(len(trajectories), 'road user')}, {begin:g} to {end:g} s"
    scene.seip.traffic.loaded = "\n".join((users, describe_categories(trajectories), *warnings))


class SEIP_OT_clear_traffic(ShortWork, bpy.types.Operator):
    """Remove the loaded road users from the scene; your own objects stay"""

    bl_options = {"REGISTER", "UNDO"}

    obstacles = (lambda scene: "" if contract.find(scene, contract.TRAFFIC) else "there is no traffic in the scene",)

    def act(self, context: bpy.types.Context) -> None:
        """Take it out."""
        scene = context.scene
        clear_traffic(scene)
        scans.forget_scan(scene)
        scene.seip.traffic.loaded = ""


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where traffic comes from."""
    traffic = context.scene.seip.traffic
    column = layout.column(align=True)
    draw_path(column, traffic, "file", "Traffic (.npz, .xml)", named=False)
    files = traffic.files()
    if files is not None and not files.trajectories:
        draw_path(column, traffic, "routes", "Routes (vehicle types)", named=False)
        draw_path(column, traffic, "net", "Network (.net.xml)", named=False)
    draw_reason(layout, why_no_load(context.scene) if traffic.file else "")  # an empty field says so itself
    row = layout.row(align=True)
    draw_run(row, "seip.load_traffic")
    row.operator("seip.clear_traffic", text="", icon="TRASH")
    row.operator("screen.animation_play", text="", icon="PLAY")
    for line in traffic.loaded.splitlines():
        draw_sentence(layout, line)
