"""Point Cloud Data files, binary, as PCL and Open3D read them: the merged cloud, and that of each sensor.

All clouds are in the site's local axes, so that they lie over each other when they are opened together. The viewpoint
of a sensor's cloud is the sensor's pose, that of the merged cloud is the identity. Source: Point Cloud Library, "The
PCD (Point Cloud Data) file format", version 0.7.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SeipError
from ...geometry.orientation import quaternion_of
from .format_interface import Format
from .sample import Sample, TrafficRun, cloud

MERGED = "merged"
IDENTITY = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # viewpoint in the origin
POINT_TYPE = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")])


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return ``SPLIT/RUN/SENSOR/FRAME.pcd`` of every sensor and of all together."""
    points = cloud(sample.frame)

    def only(number: int) -> Callable[[], bytes]:
        sensor = sample.run.sensors[number]
        viewpoint = (*sensor.xyz.tolist(), *quaternion_of(sensor.orientation).tolist())
        return lambda: encode(points[sample.frame.sensor == number].view(POINT_TYPE)[:, 0], viewpoint)

    labels = [sensor.label for sensor in sample.run.sensors]
    clouds = {MERGED: lambda: encode(points.view(POINT_TYPE)[:, 0])}
    clouds |= {label: only(number) for number, label in enumerate(labels)}
    run = sample.run
    return {f"{run.split}/{run.name}/{folder}/{sample.frame_id}.pcd": content for folder, content in clouds.items()}


def encode(points: NDArray[Any], viewpoint: Sequence[float] = IDENTITY) -> bytes:
    """Return a structured array of little-endian float32 fields, (n,), as a binary PCD file.

    Parameters
    ----------
    viewpoint : sequence of 7 float
        Position (metres) and orientation (quaternion w, x, y, z) of the sensor in the axes of the points.
    """
    names = points.dtype.names or ()
    lines = (
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join('4' for _ in names)}",
        f"TYPE {' '.join('F' for _ in names)}",
        f"COUNT {' '.join('1' for _ in names)}",
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        f"VIEWPOINT {' '.join(f'{round(number, 9) + 0.0:.12g}' for number in viewpoint)}",
        f"POINTS {len(points)}",
        "DATA binary",
    )
    return ("\n".join(lines) + "\n").encode() + points.tobytes()


def notes(run: TrafficRun) -> tuple[str, ...]:
    """Note nothing, but see that no sensor is called as the merged cloud is."""
    if any(sensor.label.lower() == MERGED for sensor in run.sensors):
        raise SeipError(f"a sensor is called '{MERGED}', as is the folder of the merged cloud; rename its empty")
    return ()


FORMAT = Format("pcd", "PCD clouds", {}, sample_files, notes=notes)
