"""Result of a verification: an installed system compared with its plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ... import limits
from ...site.scene_geometry import SceneGeometry
from .background import Background
from .comparison import Change, RayComparison
from .registration import Registration
from .unit_gain import Gain, ReturnShare


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


@dataclass(frozen=True)
class CoverageSteps:
    """Coverage of the same targets, 0 to 1, from the plan to the recording.

    Parameters
    ----------
    promised : float
        Planned poses, the scene, and the models.
    pose : float
        The same with the fitted poses.
    obstacles : float
        The same with the corrected scene.
    installed : float
        The same with the gain of each unit: what the installation covers.
    returned : float
        Targets with a background return within δ in the share of sweeps that detection demands. It exceeds coverage
        where the surface differs from place to place, because one bright spot within δ is enough.
    """

    promised: Annotated[float, limits.SHARE]
    pose: Annotated[float, limits.SHARE]
    obstacles: Annotated[float, limits.SHARE]
    installed: Annotated[float, limits.SHARE]
    returned: Annotated[float, limits.SHARE]


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
