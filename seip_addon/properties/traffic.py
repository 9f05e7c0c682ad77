"""Properties of the traffic: where it comes from, how it is simulated, and how it is scanned."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.output.datasets.formats import FORMATS
from ..core.output.datasets.sample import SPLITS
from ..core.programs.sumo_programs import NETWORK_SUFFIX
from ..core.sensing.scans.simulation import ScanSettings
from ..core.sensing.traffic.source import TrafficFiles
from ..core.workflows.recording import RecordingSettings
from ..core.workflows.traffic_simulation import DEFAULT_RUNS, SimulationSettings
from ..core.world.openstreetmap.site import is_extract
from ..core.world.traffic_simulation.demand import Demand
from ..scene import contract
from .conversion import absolute, as_typed, of_setting, path_property

EXAMPLE = "Example"
"""In place of a traffic file: the traffic of the example, which is at another path on every machine."""
EXAMPLES = Path(__file__).resolve().parents[2] / "scenes"
"""Folder of the example: beside the package, in a checkout as in the extension."""
EXAMPLE_RUN, EXAMPLE_MAP = EXAMPLES / "junction_traffic" / "run-1.npz", EXAMPLES / "junction.xodr"
_MOST_SECONDS = 3600.0


class SEIP_PG_traffic(bpy.types.PropertyGroup):
    """Source of the traffic, and settings of its scans."""

    file: path_property(
        "Traffic",
        "Trajectories (.npz) or floating car data of SUMO (.xml, packed or not); "
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


class SEIP_PG_simulation(bpy.types.PropertyGroup):
    """Settings of the simulation of traffic, and what was simulated last."""

    map: path_property(
        "Map",
        "Map of the site, on which SUMO simulates traffic: OpenDRIVE (.xodr) or a network of SUMO "
        "(.net.xml), as a file, or a text in this file such as the streets of an extract; "
        f"{EXAMPLE} for that of the example. Empty for the map beside the file",
    )
    flow: of_setting(Demand, "flow", "Vehicles/h", min=1.0, soft_max=1200.0, step=5000, precision=0)
    pedestrians: of_setting(Demand, "pedestrians", "Pedestrians/h", soft_max=1200.0, step=5000, precision=0)
    duration: of_setting(
        SimulationSettings, "duration", "Duration (s)", min=1.0, max=_MOST_SECONDS, step=1000, precision=0
    )
    count: IntProperty(
        name="Runs",
        description="Number of runs, each with a seed of its own. An interval of the average precision needs four, a "
        "placement in traffic two; more give closer figures",
        default=DEFAULT_RUNS,
        min=1,
        soft_max=16,
        max=1000,
    )
    folder: path_property(
        "Folder", "Folder for the runs only; // is the folder of the .blend", folder=True, default="//seip-traffic/"
    )
    facts: StringProperty(name="Simulated", description="Summary of the last simulation")
    made_with: StringProperty(name="Made With", description="Settings of the last simulation")

    def street_map(self) -> Path | bpy.types.Text | None:
        """Return the map that traffic is simulated on: a file, which may not exist, a text, or None."""
        if self.map == EXAMPLE:
            return EXAMPLE_MAP
        if self.map:
            return bpy.data.texts.get(self.map) or absolute(self.map)
        name, file = str(self.id_data.get(contract.MAP, "")), Path(bpy.data.filepath)
        if not name or not bpy.data.filepath:
            return None
        # `seip build-scene` writes the map of an extract's streets beside the scene, under the name of the scene
        path = file.with_suffix(NETWORK_SUFFIX) if is_extract(Path(name)) else file.with_name(name)
        return path if path.is_file() else None

    def settings(self) -> SimulationSettings:
        """Return the settings of the runs as the core takes them."""
        demand = Demand(flow=as_typed(self.flow), pedestrians=as_typed(self.pedestrians))
        return SimulationSettings(demand, duration=as_typed(self.duration))

    def key(self) -> str:
        """Return all that the runs follow from, as one text."""
        return "|".join(
            (self.map, *(f"{value:g}" for value in (self.flow, self.pedestrians, self.duration, self.count)))
        )
