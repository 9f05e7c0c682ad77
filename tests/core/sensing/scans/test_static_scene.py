"""What stands still, shared by the threads that scan it."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
THREADS = """
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
import numpy as np
import shapely
from seip_addon.core.sensing.scans.static_scene import StaticScene
random = np.random.default_rng(2)
nothing = np.empty((0, 3, 3)), np.empty(0)
points = random.uniform(-0.5, 0.5, (50, 3))
begin = Barrier(4)
def ask(scene):
    begin.wait()
    return scene.inside(points)
with ThreadPoolExecutor(4) as pool:
    for _ in range(8_000):
        angles = np.sort(random.uniform(0.0, 2 * np.pi, 300))
        region = shapely.Polygon(np.column_stack([np.cos(angles), np.sin(angles)]))
        assert all(found.all() for found in pool.map(ask, [StaticScene(*nothing, region)] * 4))
"""


@pytest.mark.slow
def test_points_are_looked_for_in_a_region_from_threads():
    """Without the region's index, some runs of this end with a corrupt heap."""
    subprocess.run([sys.executable, "-c", THREADS], cwd=ROOT, check=True)  # noqa: S603
