"""Scans and their labels as datasets, in the formats that the field's trainers and viewers read.

Each module is one format; `FORMATS` names them and `write_dataset` writes them.
"""

from . import kitti, las, mmdetection3d, openpcdet, opv2v, pcd
from .dataset_folder import load_manifest, write_dataset
from .format_interface import Format
from .sample import SPLITS, Sample, SensorPose, TrafficRun

FORMATS: dict[str, Format] = {
    kind.key: kind
    for kind in (openpcdet.FORMAT, mmdetection3d.FORMAT, kitti.FORMAT, opv2v.FORMAT, pcd.FORMAT, las.FORMAT)
}
"""By the name that a user types."""

__all__ = ["FORMATS", "SPLITS", "Format", "Sample", "SensorPose", "TrafficRun", "load_manifest", "write_dataset"]
