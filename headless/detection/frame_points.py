"""Changes to the points of a frame that keep the counts in its labels right."""

from dataclasses import replace

import numpy as np

from seip_addon.core.base.arrays import Boolean
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame

POINT_FIELDS = ("points", "sensor", "delay", "intensity", "instance", "foreground")


def some_points(frame: Frame, kept: Boolean) -> Frame:
    """Return the frame with the points of a mask (n,); the counts in its labels are those of all points."""
    return replace(frame, **{name: getattr(frame, name)[kept] for name in POINT_FIELDS})


def recounted(frame: Frame) -> Frame:
    """Return the frame with updated numbers of returns in its labels."""
    labels = frame.labels
    most = max(int(labels.user.max(initial=0)), int(frame.instance.max(initial=0))) + 1
    on_users = frame.instance != STATIC_INSTANCE
    sensors = labels.points.shape[1]
    cell = frame.instance[on_users].astype(np.int64) * sensors + frame.sensor[on_users]
    counts = np.bincount(cell, minlength=most * sensors).reshape(most, sensors)
    return replace(frame, labels=replace(labels, points=counts[labels.user]))
