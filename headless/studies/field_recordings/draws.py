"""Errors of verifications against the installations that were drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from headless.studies.field_recordings.changed_site import GAIN, ChangedSite

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.estimates import percentiles
from seip_addon.core.sensing.recordings.registration import rotation_vector
from seip_addon.core.sensing.recordings.verification import Verification
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.storage.files import save_json

_FOUND = 2.0  # metres between a tree and the box that shows it


@dataclass(frozen=True)
class Draw:
    """Result of one installation.

    Parameters
    ----------
    position, rotation : float
        Largest error of a component of any sensor's pose: metres, radians.
    pose_covered, gain_covered : float, 0 to 1
        Share of the intervals of pose components, and of gains, that contain the truth.
    gain : float
        Mean ratio of fitted to true gain.
    trees, building : float, 0 to 1
        Share of the planted trees that were found, and whether the missing building was.
    false_changes : int
        Changes that were reported and not made.
    """

    position: float
    rotation: float
    pose_covered: float
    gain: float
    gain_covered: float
    trees: float
    building: float
    false_changes: int


def draw_of(found: Verification, planned: Sequence[MountedSensor], site: ChangedSite) -> Draw:
    """Return the errors of a verification."""
    errors, covered, gains, within = [], [], [], []
    for one, plan, true in zip(found.sensors, planned, site.sensors, strict=True):
        pose = one.registration
        shift = np.concatenate([true.xyz - plan.xyz, rotation_vector(true.orientation @ plan.orientation.T)])
        errors.append(np.abs(pose.shift - shift))
        covered.append(np.abs(pose.shift - shift) <= pose.half_width)
        if one.gain is not None:
            gains.append(one.gain.value / GAIN)
            within.append(one.gain.low <= GAIN <= one.gain.high)
    new = np.array([change.box[:2] for change in found.changes if change.kind == "new"]).reshape(-1, 2)
    gone = [change.name for change in found.changes if change.kind == "gone"]
    apart = np.linalg.norm(new[:, None] - site.trees, axis=2)
    error: Float = np.array(errors)
    return Draw(
        position=float(error[:, :3].max()),
        rotation=float(error[:, 3:].max()),
        pose_covered=float(np.mean(covered)),
        gain=float(np.mean(gains)),
        gain_covered=float(np.mean(within)),
        trees=float((apart <= _FOUND).any(axis=0).mean()),
        building=float(site.gone in gone),
        false_changes=int((apart > _FOUND).all(axis=1).sum()) + sum(name != site.gone for name in gone),
    )


def describe(draws: Sequence[Draw]) -> list[str]:
    """Return the figures over all draws, in sentences."""

    def values(name: str) -> Float:
        return np.array([getattr(draw, name) for draw in draws], dtype=np.float64)

    position, rotation, low_high = 1000 * values("position"), 1000 * values("rotation"), percentiles(values("gain"))
    gain = "{:.2f} times the true one ({:.2f} to {:.2f})".format(values("gain").mean(), *low_high)
    return [
        f"{len(draws)} installations",
        f"position: {np.median(position):.1f} mm (largest {position.max():.1f} mm)",
        f"rotation: {np.median(rotation):.2f} mrad (largest {rotation.max():.2f} mrad)",
        f"intervals of the pose contain the truth: {values('pose_covered').mean():.0%}",
        f"gain: {gain}; intervals contain the truth: {values('gain_covered').mean():.0%}",
        f"trees found: {values('trees').mean():.0%}; missing building found: {values('building').mean():.0%}",
        f"false changes: {values('false_changes').mean():.1f} in each",
    ]


def save_draws(path: Path, draws: Sequence[Draw]) -> None:
    """Write the figures of each draw."""
    save_json(path, {"schema": "seip-field-draws/1", "draws": [asdict(draw) for draw in draws]})
