"""Result of a verification: an installed system compared with its plan."""

from __future__ import annotations

from dataclasses import dataclass

from ...site.scene_geometry import SceneGeometry
from .background import Background
from .comparison import Change, RayComparison
from .figures import CoverageSteps, Gain, ReturnShare
from .registration import Registration


@dataclass(frozen=True, eq=False)
class VerifiedSensor:
    """One sensor of a verified installation.

    Parameters
    ----------
    registration : Registration
        Its pose, fitted to the recording.
    background : Background
        Its static surroundings.
    comparison : RayComparison
        Predicted and measured ranges at that pose.
    gain : Gain or None
        Its received power; None if the recording does not determine it.
    shares : tuple of ReturnShare
        Shares of its rays that return.
    """

    registration: Registration
    background: Background
    comparison: RayComparison
    gain: Gain | None
    shares: tuple[ReturnShare, ...]


@dataclass(frozen=True, eq=False)
class Verification:
    """Result of a verification.

    Parameters
    ----------
    changes : tuple of Change
        What the scene lacks, and what is no longer there.
    costs : tuple of float
        Coverage that each change costs (0 to 1, negative if it gains); NaN for vehicles and for small changes.
    corrected : SceneGeometry
        The scene with the changes, without vehicles.
    """

    sensors: tuple[VerifiedSensor, ...]
    changes: tuple[Change, ...]
    costs: tuple[float, ...]
    coverage: CoverageSteps
    corrected: SceneGeometry
