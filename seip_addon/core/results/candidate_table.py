"""``candidates.csv``: every candidate pose with what it sees, for a spreadsheet."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..deployment import Deployment, weighted_share
from ..lidar import LidarModel
from ..site import Site
from ..storage import whole_file
from .headings import degrees, tilt_degrees

COLUMNS = (
    "pose",
    "position",
    "on_pole",
    "pole_source",
    "sensor",
    "height_m",
    "x_m",
    "y_m",
    "z_m",
    "map_x_m",
    "map_y_m",
    "map_z_m",
    "yaw_deg",
    "tilt_deg",
    "price_usd",
    "targets_seen",
    "coverage",
    "weighted_coverage",
    "rank",
    "chosen",
)


def save_candidate_table(
    path: str | os.PathLike[str],
    site: Site,
    models: Mapping[str, LidarModel],
    visible: NDArray[np.bool_],
    deployment: Deployment,
) -> None:
    """Write one row for each pose, in the order of the poses.

    Parameters
    ----------
    path : path-like
        The file to write.
    site : Site
    models : mapping of str to LidarModel
        The sensor types by catalogue key.
    visible : (c, t) bool
        Which pose sees which target.
    deployment : Deployment
        The chosen sensors; their labels stand in the column ``chosen``.
    """
    label = {sensor.pose: sensor.label for sensor in deployment.sensors}
    seen = visible.sum(axis=1)
    weighted = np.array([weighted_share(row, site.targets.weight) for row in visible])
    rank = _ranks(weighted, seen)
    candidates = site.candidates
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for pose, position in enumerate(candidates.position_of):
            model = models[str(candidates.sensor[pose])]
            xyz = candidates.xyz[pose]
            writer.writerow(
                (
                    pose,
                    candidates.position_name[position],
                    int(candidates.on_pole[position]),
                    candidates.pole_source[position],
                    model.key,
                    f"{candidates.height[pose]:.3f}",
                    *(f"{value:.3f}" for value in xyz),
                    *(f"{value:.3f}" for value in xyz + site.origin),
                    f"{degrees(candidates.yaw[pose]):.3f}",
                    f"{tilt_degrees(candidates.tilt[pose]):.3f}",
                    f"{model.price:.2f}",
                    seen[pose],
                    f"{seen[pose] / len(site.targets):.6f}",
                    f"{weighted[pose]:.6f}",
                    rank[pose],
                    label.get(pose, ""),
                )
            )


def _ranks(weighted: NDArray[np.float64], seen: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return 1 for the pose that alone sees the most weight; equals go by targets seen, then by index."""
    order = np.lexsort((np.arange(len(seen)), -seen, -weighted))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(1, len(order) + 1)
    return rank
