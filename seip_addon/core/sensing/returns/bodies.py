"""Bodies of road users as upright panels that face the sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

BodyName = Literal["car", "cyclist", "pedestrian"]


@dataclass(frozen=True)
class Panel:
    """An upright panel that stands on the road, faces the sensor and returns light like a road user.

    The heading of a road user is not known without traffic. A panel has the mean silhouette over all headings.

    Parameters
    ----------
    width, height : float, metres
        Size of the panel. The width is the area of the silhouette, seen from the side and averaged over all headings,
        divided by the height.
    reflected : float, 0 to 1
        Mean over the silhouette of reflectivity times cosine of the angle of incidence.
    """

    width: float
    height: float
    reflected: float


PANELS: Mapping[BodyName, Panel] = MappingProxyType(
    {
        "car": Panel(3.08, 1.5, 0.257),
        "cyclist": Panel(0.394, 1.7, 0.225),
        "pedestrian": Panel(0.204, 1.719, 0.283),
    }
)
"""Panels of the road users that SUMO simulates by default: a car of 5.0 × 1.8 × 1.5 m, a person of 0.22 × 0.48 × 1.72 m
and a bicycle of 1.6 × 0.65 × 1.7 m, with the bodies and materials of scans and paint of 50 % (`traffic.bodies`)."""
