"""Coverage of a placement over the plausible gains of sensors whose law of detection comes from a data sheet."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...base.progress import Progress
from ...sensing.lidar.model import LidarModel
from ...sensing.visibility.surroundings import Surroundings
from ...sensing.visibility.visibility_model import visibility_model
from ..placement.deployment import Deployment, GainBand, TypeBand


def with_gain_band(around: Surroundings, deployment: Deployment) -> Generator[Progress, None, Deployment]:
    """Return a deployment with its coverage at the lowest and at the highest plausible gains of its sensors.

    If there are several sensor types to choose from, the band also has the coverage with all sensors of each type. It
    shows how far types can be compared at this site in spite of uncertain gains.

    Parameters
    ----------
    around : Surroundings
        Site with all sensor types that could be chosen.

    Returns
    -------
    Deployment
        Deployment with the band; unchanged if each type is calibrated or counts every return.
    """
    sensors = deployment.sensors
    types = list(around.models.values())
    if not sensors or not any(is_uncertain(model) for model in (*types, *(one.model for one in sensors))):
        return deployment
    compared = types if len(types) > 1 else []
    visibility = visibility_model(around.site, around.sight, around.engine)
    seen = np.zeros((2 + 2 * len(compared), len(around.site.targets)), dtype=bool)
    for done, sensor in enumerate(sensors):
        yield Progress(done, len(sensors), "coverage over plausible gains")
        variants = [model.amplified(gain) for model in (sensor.model, *compared) for gain in model.gains]
        seen |= np.array([visibility.see(variant, sensor.xyz, sensor.orientation) for variant in variants])
    shares = [float(row.mean()) for row in seen]
    band = GainBand(
        low=min(shares[0], deployment.coverage),
        high=max(shares[1], deployment.coverage),
        sheets=tuple(sorted({one.model.key for one in sensors if is_uncertain(one.model)})),
        types=tuple(TypeBand(model.key, *shares[2 + 2 * n : 4 + 2 * n]) for n, model in enumerate(compared)),
    )
    return replace(deployment, gain_band=band)


def is_uncertain(model: LidarModel) -> bool:
    """Return whether the gain of a model is only known within a band."""
    low, high = model.gains
    return low < high
