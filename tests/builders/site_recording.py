"""Recordings of sensors at a site that has changed since it was planned, simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.output.datasets.formats import POINT_TYPE, encode
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry

EVERY = 1.2  # seconds between sweeps


def save_site_recording(
    folder: Path,
    geometry: SceneGeometry,
    sensors: Sequence[MountedSensor],
    traffic: Trajectories,
    *,
    sweeps: int = 20,
    seed: int = 0,
) -> Path:
    """Write sweeps of sensors in their own axes, a folder of PCD files for each; traffic is in local axes."""
    bodies = [fitted_body(user) for user in traffic.users]
    static = static_scene(geometry, sensors)
    simulation = finish(prepare(static, sensors, traffic, bodies, ScanSettings(seed)))
    for number in range(sweeps):
        frame = simulation.frame(number, EVERY * number)
        for row, sensor in enumerate(sensors):
            own = frame.sensor == row
            points = np.column_stack([(frame.points[own] - sensor.xyz) @ sensor.orientation, frame.intensity[own]])
            path = folder / sensor.label / f"{number:06d}.pcd"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(encode(np.ascontiguousarray(points.astype("<f4")).view(POINT_TYPE)[:, 0]))
    for sensor in sensors:
        times = "\n".join(str(EVERY * number) for number in range(sweeps))
        (folder / sensor.label / "timestamps.txt").write_text(times, encoding="utf-8")
    return folder


def changed(geometry: SceneGeometry, gone: str, new: Sequence[Mesh]) -> SceneGeometry:
    """Return a site without one of its occluders and with others."""
    others = tuple(mesh for mesh in geometry.occluders if mesh.name != gone)
    assert len(others) == len(geometry.occluders) - 1
    return replace(geometry, occluders=(*others, *new))
