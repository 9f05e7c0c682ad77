"""Figures of a verification that its record keeps: gain, shares of returns, and coverage from plan to recording."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Gain:
    """Received power of a unit as a multiple of that in its model's law, with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class ReturnShare:
    """Shares of the rays that return from one kind of surface in one range.

    Parameters
    ----------
    surface : str
        ``road``, ``ground`` or ``objects``.
    low, high : float, metres
        Range.
    rays : int
    predicted, fitted, measured : float, 0 to 1
        By the model's law, by the law with the unit's gain, and in the recording.
    """

    surface: str
    low: float
    high: float
    rays: int
    predicted: float
    fitted: float
    measured: float


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
