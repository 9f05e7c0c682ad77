"""Pedestrians and the riders of two-wheelers out of few triangles, at a usual size.

They are drawn in metres where one would measure them, and stretched to a
road user's size afterwards.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Float
from .body_parts import Part, ball, box, hoop, hull, limb, pane, face_across, rim, wheel

HEAD = np.array([0.10, 0.08, 0.13])
"""Half a head's depth, width and height (metres)."""


def pedestrian() -> list[Part]:
    """Return someone who walks: left leg and right arm forward."""
    torso = [(-0.11, 0.86, 0.15), (0.10, 0.86, 0.15), (0.13, 1.20, 0.17), (0.08, 1.46, 0.19), (-0.10, 1.46, 0.19)]
    parts = [hull(np.array(torso), "cloth"), *_head(np.array([0.01, 0.0, 1.60]), "hair")]
    for side, stride in ((1.0, 0.26), (-1.0, -0.24)):
        hip, ankle = _at(0.0, 0.09 * side, 0.90), _at(stride, 0.09 * side, 0.06)
        shoulder, hand = _at(-0.01, 0.21 * side, 1.43), _at(0.02 - 0.8 * stride, 0.24 * side, 0.82)
        parts += [
            limb(hip, ankle, (0.11, 0.065), "trousers"),
            box((stride - 0.09, 0.09 * side - 0.05, 0.0), (stride + 0.18, 0.09 * side + 0.05, 0.08), "trim"),
            limb(shoulder, hand, (0.065, 0.04), "cloth"),
            ball(hand - [0.0, 0.0, 0.06], np.array([0.05, 0.04, 0.08]), "skin"),
        ]
    return parts


def bicycle() -> list[Part]:
    """Return a city bicycle with its rider upright on it."""
    rear, front, radius = 0.35, 1.42, 0.35
    saddle, crank, head_tube = _at(0.55, 0.0, 0.95), _at(0.78, 0.0, 0.30), _at(1.22, 0.0, 0.95)
    bars = [
        (saddle, crank, 0.022),
        (crank, head_tube, 0.024),
        (_at(0.60, 0.0, 0.82), _at(1.20, 0.0, 0.86), 0.022),
        (_at(rear, 0.0, radius), crank, 0.018),
        (_at(1.20, 0.0, 1.06), _at(front, 0.0, radius), 0.022),
    ]
    return [
        hoop(rear, radius, 0.05),
        hoop(front, radius, 0.05),
        *(limb(start, stop, (radius_, radius_), "frame", sides=3) for start, stop, radius_ in bars),
        limb(_at(1.15, -0.30, 1.08), _at(1.15, 0.30, 1.08), (0.02, 0.02), "frame", sides=3),
        *_rider(
            hip=_at(0.55, 0.10, 1.00),
            knees=(_at(0.92, 0.12, 0.86), _at(0.90, 0.12, 0.62)),
            feet=(_at(0.80, 0.13, 0.46), _at(0.76, 0.13, 0.12)),
            shoulder=_at(0.72, 0.18, 1.48),
            hand=_at(1.12, 0.27, 1.10),
            head=_at(0.80, 0.0, 1.67),
            cover="hair",
        ),
    ]


def motorcycle() -> list[Part]:
    """Return a motorcycle with its rider bent forward."""
    rear, front, radius = 0.32, 1.78, 0.32
    body = [
        (0.05, 0.86, 0.09), (0.55, 0.55, 0.12), (0.62, 0.22, 0.16), (1.20, 0.22, 0.17), (1.46, 0.62, 0.15),
        (1.58, 0.98, 0.16), (1.40, 1.06, 0.14), (1.00, 0.98, 0.15), (0.85, 0.80, 0.13), (0.05, 0.93, 0.09),
    ]  # fmt: skip
    outline = np.array(body)
    return [
        wheel(rear, 0.085, -0.085, radius),
        wheel(front, 0.06, -0.06, radius),
        *(rim(front, y, -y / 0.06, radius) for y in (-0.06, 0.06)),
        hull(outline, "paint"),
        pane(face_across(outline[4], outline[5], front=True), (0.15, 0.85), (0.35, 0.95), "headlamp"),
        pane(face_across(outline[0], outline[-1], front=False), (0.1, 0.9), (0.1, 0.9), "tail lamp"),
        *(limb(_at(1.48, y, 1.0), _at(front, y, radius), (0.035, 0.03), "frame", sides=3) for y in (-0.09, 0.09)),
        limb(_at(1.40, -0.40, 1.06), _at(1.40, 0.40, 1.06), (0.025, 0.025), "trim", sides=3),
        *_rider(
            hip=_at(0.78, 0.12, 0.92),
            knees=(_at(1.16, 0.24, 0.74), _at(1.16, 0.24, 0.74)),
            feet=(_at(0.86, 0.24, 0.34), _at(0.86, 0.24, 0.34)),
            shoulder=_at(1.00, 0.20, 1.34),
            hand=_at(1.40, 0.36, 1.08),
            head=_at(1.14, 0.0, 1.50),
            cover="trim",
        ),
    ]


def _rider(
    *,
    hip: Float,
    knees: tuple[Float, Float],
    feet: tuple[Float, Float],
    shoulder: Float,
    hand: Float,
    head: Float,
    cover: str,
) -> list[Part]:
    """Return who sits on a two-wheeler; joints are those of the left side, knees and feet of left and right."""
    lean = shoulder - hip
    torso = np.array(
        [
            (hip[0] - 0.13, hip[2] - 0.06, 0.16),
            (hip[0] + 0.12, hip[2] - 0.02, 0.16),
            (hip[0] + 0.6 * lean[0] + 0.14, hip[2] + 0.6 * lean[2], 0.18),
            (shoulder[0] + 0.07, shoulder[2] + 0.02, 0.19),
            (shoulder[0] - 0.11, shoulder[2] + 0.05, 0.19),
        ]
    )
    parts = [hull(torso, "cloth"), *_head(head, cover)]
    for knee, foot, side in zip(knees, feet, (1.0, -1.0), strict=True):
        mirror = np.array([1.0, side, 1.0])
        parts += [
            limb(hip * mirror, knee * mirror, (0.10, 0.075), "trousers"),
            limb(knee * mirror, foot * mirror, (0.075, 0.05), "trousers"),
            limb((foot - [0.07, 0.0, 0.02]) * mirror, (foot + [0.18, 0.0, -0.04]) * mirror, (0.06, 0.045), "trim"),
            limb(shoulder * mirror, hand * mirror, (0.065, 0.04), "cloth"),
        ]
    return parts


def _head(middle: Float, cover: str) -> list[Part]:
    """Return a face and what covers it behind and above: hair or a helmet."""
    return [ball(middle, HEAD, "skin"), ball(middle + [-0.03, 0.0, 0.025], HEAD * [1.0, 1.12, 1.0], cover)]


def _at(x: float, y: float, z: float) -> Float:
    return np.array([x, y, z])
