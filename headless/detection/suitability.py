"""Warnings where a detector is used beyond the sensor types, sites and densities that it was trained on."""

from collections.abc import Sequence

from seip_addon.core.sensing.scans.frame import Frame

from .detection_area import DetectionArea
from .detector import Detector
from .pillars import filling

MAX_OVERFULL_SHARE = 0.6
"""Share of the pillars with points that may have more than are kept: up to it no significant loss was found.

Measured on the shipped junction with four sensors of 32 channels, where pillars
kept fewer points than in training: `disturbances.Capped`.
"""


def suitability_warnings(
    detector: Detector, sensors: Sequence[str], area: DetectionArea, frame: Frame
) -> tuple[str, ...]:
    """Return warnings about using a detector beyond the types, the sites and the densities that it was trained on.

    Parameters
    ----------
    sensors : sequence of str
        Catalogue keys of the types whose clouds it is used on.
    area : DetectionArea
        Detection area of the site.
    frame : Frame
        That it is used on.
    """
    found = (_of_types(detector, sensors), _of_site(detector, area.site), _of_pillars(detector, area, frame))
    return tuple(sentence for sentence in found if sentence)


def _of_types(detector: Detector, sensors: Sequence[str]) -> str:
    trained, foreign = detector.training_record.sensors, sorted(set(sensors) - set(detector.training_record.sensors))
    if not trained or not foreign:
        return ""
    return (
        f"the detector was trained on clouds of {' and '.join(trained)}, not of {' and '.join(foreign)}: "
        "test it on clouds of these types before you trust it with them, or train it on them too"
    )


def _of_site(detector: Detector, site: str) -> str:
    sites = detector.training_record.sites
    if not site or len(sites) != 1 or site in sites:
        return ""
    return (
        f"the detector was trained only at {sites[0]}, not at {site}: at other sites it may find less than the "
        "shipped detector, which was trained at many sites"
    )


def _of_pillars(detector: Detector, area: DetectionArea, frame: Frame) -> str:
    most = detector.settings.most_points
    full = filling(area.cloud(frame), area.grid, most)
    if full.over_full <= MAX_OVERFULL_SHARE:
        return ""
    return (
        f"{full.over_full:.0%} of the pillars with points have more than the {most} that are kept, "
        f"and {full.left_out:.0%} of all points are left out: choose smaller pillars, or let them keep more"
    )
