"""Average precision of one placement at a site of the open benchmark."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from headless import survey
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.rules import CLASSES, RULES, precision_by
from headless.detection.shared_scans import SharedScans, detect_with_all
from headless.studies.detection.case_study import split_untrained

import bpy
import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate
from seip_addon.core.base.progress import Progress
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

Found = tuple[dict[str, IntervalEstimate], tuple[str, ...]]
"""Average precision by class of road users, and the types of the sensors."""


def placement_precision(folder: Path, placed: Path, every: float, output: Path) -> Generator[Progress, None, Found]:
    """Evaluate the shipped detector with the sensors of a scene, on the test traffic of a site of the benchmark.

    Parameters
    ----------
    folder : path
        Folder of the site, which has been built.
    placed : path
        Scene with the sensors, whose positions are those in the scene of the site.
    every : float, seconds
        Time from frame to frame.
    output : path
        Folder of the benchmark, for what was detected.

    Raises
    ------
    SeipError
        The site has not been built, or the scene has no sensor.
    """
    scene = folder / "site.blend"
    if not scene.is_file():
        raise SeipError(f"{scene} does not exist: build the benchmark first, with --build --site {folder.name}")
    open_blend(placed)
    sensors = read_sensors(bpy.context.scene, load_catalogue())
    if not sensors:
        raise SeipError(f"{placed} has no sensors: place some with seip place")
    open_blend(scene)
    geometry = read_scene(bpy.context.scene).geometry
    _, tests = split_untrained(sampled_runs(survey.runs_beside(scene), geometry.origin, every))
    detector = Detector.load(SHIPPED_DETECTOR)
    simulator = Simulator(geometry, ScanSettings(rolling_shutter=True), sensors)  # as the table was made
    placement = MountedSensors(placed.stem, sensors)
    (frames,) = yield from detect_with_all(SharedScans(simulator, [placement]), tests, detector, output)
    found = {}
    for name, rule in CLASSES.items():
        one = precision_by(frames, RULES[rule])
        low, high = one.interval or (-np.inf, np.inf)
        if one.road_users:
            found[name] = IntervalEstimate(one.average_precision, low, high)
    return found, tuple(sensor.model.key for sensor in sensors)
