"""``candidates.csv``: every candidate pose with what it sees, for a spreadsheet."""

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...choosing.placement.deployment import Deployment, Sensor, sensor_at, weighted_share
from ...geometry.orientation import degrees, tilt_degrees
from ...sensing.lidar.model import LidarModel
from ...site.site import Site
from ...storage.csv_table import save_csv

COLUMNS = (
    "pose", "position", "on_pole", "pole_source", "sensor", "height_m", "x_m", "y_m", "z_m",
    "map_x_m", "map_y_m", "map_z_m", "yaw_deg", "tilt_deg", "price_usd",
    "targets_seen", "coverage", "weighted_coverage", "rank", "chosen",
)  # fmt: skip


def save_candidate_table(
    path: str | os.PathLike[str],
    site: Site,
    models: Mapping[str, LidarModel],
    visible: NDArray[np.bool_],
    deployment: Deployment,
) -> None:
    """Write one row for each pose, in order, and then one for each sensor that was moved by hand.

    ``visible`` (c, t) is the visibility grid; labels of the chosen sensors are in the column ``chosen``.
    """
    label = {sensor.pose: sensor.label for sensor in deployment.sensors}
    seen = visible.sum(axis=1)
    weighted = np.array([weighted_share(row, site.targets.weight) for row in visible])
    rank = np.empty(len(seen), dtype=np.int64)  # 1 for the pose that alone sees the most weight; then by targets seen
    rank[np.lexsort((np.arange(len(seen)), -seen, -weighted))] = np.arange(1, len(seen) + 1)
    rows: list[tuple[object, ...]] = []
    for pose in range(len(site.candidates)):
        sensor = sensor_at(site, models, label.get(pose, ""), pose)
        source = str(site.candidates.pole_source[site.candidates.position_of[pose]])
        share = seen[pose] / len(site.targets)
        worth = (seen[pose], f"{share:.6f}", f"{weighted[pose]:.6f}", rank[pose])
        rows.append((pose, *_place(sensor, site, source), *worth, sensor.label))
    for sensor in deployment.sensors:
        if sensor.pose is None:
            worth = (round(sensor.alone * len(site.targets)), f"{sensor.alone:.6f}", "", "")
            rows.append(("", *_place(sensor, site, ""), *worth, sensor.label))
    save_csv(path, COLUMNS, rows)


def _place(sensor: Sensor, site: Site, source: str) -> tuple[object, ...]:
    """Return the columns of a sensor's position, orientation and price."""
    return (
        sensor.position_name,
        int(sensor.on_pole),
        source,
        sensor.model.key,
        f"{sensor.height:.3f}",
        *(f"{value:.3f}" for value in sensor.xyz),
        *(f"{value:.3f}" for value in sensor.xyz + site.origin),
        f"{degrees(sensor.yaw):.3f}",
        f"{tilt_degrees(sensor.tilt):.3f}",
        f"{sensor.price:.2f}",
    )
