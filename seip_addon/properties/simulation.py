"""Properties of the simulation of traffic: its demand, its map, and where its runs are written."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import IntProperty, StringProperty

from ..core.sumo_programs import NETWORK_SUFFIX
from ..core.workflows.traffic_simulation import DEFAULT_RUNS, SimulationSettings
from ..core.world.openstreetmap.site import is_extract
from ..core.world.traffic_simulation.demand import Demand
from ..scene import contract
from .conversion import absolute, as_typed, of_setting, path_property
from .traffic import EXAMPLE, EXAMPLES

EXAMPLE_MAP = EXAMPLES / "junction.xodr"
_MOST_SECONDS = 3600.0


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
