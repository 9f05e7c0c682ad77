"""Formats of datasets by the names that a user types."""

from . import kitti, las, mmdetection3d, openpcdet, opv2v, pcd
from .format_interface import Format

FORMATS: dict[str, Format] = {
    kind.key: kind
    for kind in (openpcdet.FORMAT, mmdetection3d.FORMAT, kitti.FORMAT, opv2v.FORMAT, pcd.FORMAT, las.FORMAT)
}
