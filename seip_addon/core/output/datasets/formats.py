"""Formats of datasets by the names that a user types."""

from . import kitti, mmdetection3d, openpcdet, pcd
from .format_interface import Format

FORMATS: dict[str, Format] = {
    kind.key: kind for kind in (openpcdet.FORMAT, mmdetection3d.FORMAT, kitti.FORMAT, pcd.FORMAT)
}
