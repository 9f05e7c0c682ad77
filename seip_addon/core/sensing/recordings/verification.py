"""Result of a verification: an installed system compared with its plan."""

from __future__ import annotations

from dataclasses import dataclass

from ...site.scene_geometry import SceneGeometry
from .comparison import Change, RayComparison

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Gain:
    """Received power of a unit as a multiple of that in its model's law, with its 95 % interval."""

    value: float
    low: float
    high: float


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

    promised: float
    pose: float
    obstacles: float
    installed: float
    returned: float


@dataclass(frozen=True)
class RecordedBackground:
    """Sweeps that a background was learned from; see `Background`."""

    sweeps: int
    seconds: float
    uncertain: float


@dataclass(frozen=True)
class InstalledSensor:
    """A sensor as it is installed, by its recording; see `verification.json`.

    Parameters
    ----------
    id, sensor : str
        Its label, and its type's key in the catalogue.
    local_m, orientation
        Fitted pose: position, and rows of the rotation from the sensor's axes to the site's.
    shift_m, rotation_deg
        Fitted less planned pose; the rotation vector about the site's axes.
    shift_half_width_m, rotation_half_width_deg
        Half the width of the 95 % interval of each of their components.
    match : float, 0 to 1
        Share of the rays that agree with the scene.
    """

    id: str
    sensor: str
    local_m: Triple
    orientation: tuple[Triple, Triple, Triple]
    shift_m: Triple
    shift_half_width_m: Triple
    rotation_deg: Triple
    rotation_half_width_deg: Triple
    match: float
    background: RecordedBackground
    gain: Gain | None

    @property
    def planned_m(self) -> tuple[float, ...]:
        """Planned position."""
        return tuple(at - shift for at, shift in zip(self.local_m, self.shift_m, strict=True))


@dataclass(frozen=True, eq=False)
class Verification:
    """Result of a verification.

    Parameters
    ----------
    comparisons : tuple of RayComparison
        Predicted and measured ranges of each sensor, at its fitted pose.
    changes : tuple of Change
        What the scene lacks, and what is no longer there.
    costs : tuple of float
        Coverage that each change costs (0 to 1, negative if it gains); NaN for vehicles and for small changes.
    corrected : SceneGeometry
        The scene with the changes, without vehicles.
    warnings : tuple of str
        Warnings about a short or busy recording.
    """

    sensors: tuple[InstalledSensor, ...]
    comparisons: tuple[RayComparison, ...]
    changes: tuple[Change, ...]
    costs: tuple[float, ...]
    coverage: CoverageSteps
    corrected: SceneGeometry
    warnings: tuple[str, ...] = ()
