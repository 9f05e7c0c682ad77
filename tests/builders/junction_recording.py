"""Recordings at the shipped junction, simulated with the project's scanner and traffic."""

from pathlib import Path

import bpy
import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.trajectories import Trajectories, parked_users
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene
from tests.builders.street_recording import memory_record

SCENES = Path(__file__).resolve().parents[2] / "scenes"
PLACES = ((-8.8, 12.7, 5.5), (8.2, -11.3, 5.5))


class JunctionRecording:
    """Scene, sensors, and frames of a run of traffic."""

    def __init__(self, key="os1_128"):
        open_blend(SCENES / "junction.blend")
        self.geometry = read_scene(bpy.context.scene).geometry
        model = load_catalogue()[key]
        self.planned = [MountedSensor(f"S{n}", model, np.array(xyz), np.eye(3)) for n, xyz in enumerate(PLACES, 1)]
        static = static_scene(self.geometry, self.planned)
        self.surface = ReflectiveSurface(make_ray_caster(static.triangles, "auto"), static.reflectivity)
        run = Trajectories.load(SCENES / "junction_traffic" / "run-9.npz")
        self.run = run.moved_to(self.geometry.origin)
        self.parked = parked_users(self.run)

    def frames(self, sensors, count, every, seed=0):
        """Return frames from half a second on."""
        static = static_scene(self.geometry, sensors)
        settings = ScanSettings(seed=seed)
        simulation = finish(
            prepare(static, sensors, self.run, [fitted_body(user) for user in self.run.users], settings)
        )
        return [simulation.frame(number, 0.5 + number * every) for number in range(count)]

    @staticmethod
    def records(sensors, frames, every):
        """Return the recording of each sensor, in its own axes."""
        found = []
        for number, sensor in enumerate(sensors):
            own = [frame.sensor == number for frame in frames]
            clouds = [
                ((frame.points[mask] - sensor.xyz) @ sensor.orientation).astype(np.float32)
                for frame, mask in zip(frames, own, strict=True)
            ]
            intensities = [frame.intensity[mask] for frame, mask in zip(frames, own, strict=True)]
            found.append(memory_record(sensor.label, clouds, 1 / every, intensities))
        return found
