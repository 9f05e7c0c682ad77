"""Cars, vans, trucks and buses out of few triangles, rear bumper at x = 0.

The proportions are those of European vehicles of the class, read off makers' dimension sheets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Float
from .body_parts import Part, box, face_across, hull, pane, rim, side_faces, wheel

TALL_CAR = 1.58
"""Height (metres) from which a car is an SUV."""
LONG_CAR = 4.4
"""Length (metres) from which a lower car is a saloon."""
LONG_TRUCK = 12.0
"""Length (metres) from which a truck is a tractor with a semi-trailer: a rigid one may have no more in the EU."""
LONG_BUS = 13.0
"""Length (metres) from which a bus has three axles."""
TYRE_SHARE = 0.13
"""Width of a tyre, of the vehicle's."""
TUCKED = 0.94
"""How wide a vehicle is at its front and rear edges, of its width beside them."""


@dataclass(frozen=True)
class _CarForm:
    """Where the corners of a car lie, in shares of its length (x, from the rear) and height (z)."""

    rear_axle: float
    front_axle: float
    floor: float
    belt: float
    windscreen: tuple[float, float]
    rear_window: tuple[float, float]


_SALOON = _CarForm(0.225, 0.815, 0.125, 0.63, (0.735, 0.555), (0.285, 0.125))
_HATCHBACK = _CarForm(0.170, 0.805, 0.125, 0.62, (0.765, 0.560), (0.110, 0.030))
_SUV = _CarForm(0.205, 0.805, 0.150, 0.60, (0.745, 0.575), (0.080, 0.022))


def car(length: float, width: float, height: float) -> list[Part]:
    """Return a hatchback, a saloon or an SUV, whichever has such a size."""
    form = _SUV if height >= TALL_CAR else _SALOON if length >= LONG_CAR else _HATCHBACK
    radius = min(0.215 * height, 0.078 * length)
    axles = (form.rear_axle * length, form.front_axle * length)
    belt, floor = form.belt, form.floor
    base, roof_front = form.windscreen
    roof_rear, rear_base = form.rear_window
    lower = _leaning(
        [
            *_scaled([(0.0, 0.36), (0.02, 1.35 * floor)], length, height),
            *_arches(axles, radius, floor * height),
            *_scaled([(0.978, 1.25 * floor), (1.0, 0.34), (0.985, 0.47), (0.935, 0.54)], length, height),
            *_scaled([(base + 0.02, belt - 0.005), (0.012, belt)], length, height),
        ],
        np.array([0.98, 0.92]) * width,
        belt * height,
    )
    tail, _, *_, front_low, bumper, nose, _, _, edge = lower
    for corner in (tail, front_low, bumper, nose, edge):
        corner[2] *= TUCKED
    crown = (roof_front + roof_rear) / 2
    cabin = _leaning(
        _scaled(
            [(rear_base, belt - 0.02), (base, belt - 0.02), (roof_front, 0.965), (crown, 1.0), (roof_rear, 0.965)],
            length,
            height,
        ),
        np.array([1.25, 0.68]) * width,
        height,
    )
    rear_low, cowl, front_high, _, rear_high = cabin
    front, rear = face_across(bumper, nose, front=True), face_across(tail, edge, front=False)
    return [
        hull(lower, "paint"),
        hull(cabin, "paint"),
        pane(face_across(cowl, front_high, front=True), (0.05, 0.95), (0.10, 0.94), "glass"),
        pane(face_across(rear_low, rear_high, front=False), (0.08, 0.92), (0.14, 0.90), "glass"),
        *_windows(np.array([rear_low, cowl, front_high, rear_high]), [(0.11, 0.47), (0.53, 0.89)], (0.17, 0.88)),
        *_lamps(front, (0.35, 0.95), rear, (0.45, 0.92), wide=0.22),
        pane(face_across(front_low, bumper, front=True), (0.2, 0.8), (0.25, 0.9), "trim"),
        *_pair(axles[0], width, radius),
        *_pair(axles[1], width, radius),
    ]


def van(length: float, width: float, height: float) -> list[Part]:
    """Return a panel van: a short bonnet, a steep windscreen, and a box behind the seats."""
    radius = min(0.36, 0.17 * height, 0.067 * length)
    widths = np.array([0.99, 0.84]) * width
    bonnet, screen = min(0.17 * length, 1.0), min(0.10 * length, 0.75)
    axles = (min(0.2 * length, 1.15), length - min(0.2 * length, 0.95))
    cowl_x, roof_x = length - bonnet, length - bonnet - screen
    outline = _leaning(
        [
            (0.0, 0.22 * height),
            (0.01 * length, 0.12 * height),
            *_arches(axles, radius, 0.10 * height),
            (0.985 * length, 0.11 * height),
            (length, 0.22 * height),
            (length - 0.10 * bonnet, 0.40 * height),
            (cowl_x, 0.51 * height),
            (roof_x, 0.94 * height),
            (0.6 * length, height),
            (0.01 * length, 0.97 * height),
        ],
        widths,
        height,
    )
    tail, _, *_, front_low, bumper, nose, cowl, roof, _, rear_high = outline
    for corner in (front_low, bumper, nose):
        corner[2] *= TUCKED
    door = max(0.5 * length, cowl_x - 1.5)
    doors = _leaning(
        [(door, cowl[1]), (cowl_x, cowl[1]), (roof_x, roof[1]), (door, roof[1])],
        widths,
        height,
    )
    front, rear = face_across(bumper, nose, front=True), face_across(tail, rear_high, front=False)
    return [
        hull(outline, "paint"),
        pane(face_across(cowl, roof, front=True), (0.05, 0.95), (0.06, 0.9), "glass"),
        *_windows(doors, [(0.15, 0.93)], (0.04, 0.82)),
        *(pane(rear, across, (0.45, 0.85), "glass") for across in ((0.10, 0.46), (0.54, 0.90))),
        *_lamps(front, (0.45, 0.95), rear, (0.1, 0.4), wide=0.2, rear_wide=0.1),
        pane(front, (0.32, 0.68), (0.3, 0.8), "trim"),
        *_pair(axles[0], width, radius),
        *_pair(axles[1], width, radius),
    ]


def truck(length: float, width: float, height: float) -> list[Part]:
    """Return a cab and a box behind it: a rigid truck, or from `LONG_TRUCK` on a tractor and its semi-trailer."""
    articulated = length >= LONG_TRUCK
    radius = min(0.52, 0.15 * height, 0.06 * length)
    cab = min(0.28 * length, 2.2)
    cargo = length - cab * (1.4 if articulated else 1.08)
    bed, half = min(0.30 * height, 1.2), width / 2
    if articulated:
        twins = [length - 1.75 * cab, *(0.16 * length + np.array([-2.6, 0.0, 2.6]) * radius).tolist()]
    else:
        twins = [0.22 * length]
    bar = np.array([0.0, 0.38 * bed, 0.9 * half]), np.array([0.0, 0.62 * bed, 0.9 * half])
    return [
        *_cab(length, cab, width, (0.93 if articulated else 0.80) * height, radius),
        *_pair(length - 0.62 * cab, width, radius),
        box((0.0, -half, bed), (cargo, half, height), "cargo box"),
        box((0.004 * length, -0.42 * half, 0.9 * radius), (length - 0.3 * cab, 0.42 * half, 1.02 * bed), "trim"),
        box((0.0, -0.9 * half, 0.38 * bed), (0.02 * length, 0.9 * half, 0.62 * bed), "trim"),
        *_ends(face_across(*bar, front=False), (0.1, 0.9), 0.16, "tail lamp"),
        *(_twins(axle, width, radius) for axle in twins),
    ]


def bus(length: float, width: float, height: float) -> list[Part]:
    """Return a low-floor city bus: large panes, doors on the right-hand side, air conditioning over the rear half."""
    radius = min(0.5, 0.155 * height, 0.05 * length)
    rear_axle, front_axle = min(0.28 * length, 3.4), length - min(0.23 * length, 2.7)
    twins = [rear_axle] if length < LONG_BUS else [rear_axle, rear_axle + 3.0 * radius]
    widths = np.array([0.99, 0.93]) * width
    outline = _leaning(
        [
            *_scaled([(0.0, 0.2), (0.006, 0.12)], length, height),
            *_arches((*twins, front_axle), radius, 0.09 * height),
            *_scaled([(0.992, 0.09), (1.0, 0.3), (0.972, 0.89), (0.94, 0.93)], length, height),
            *_scaled([(0.02, 0.93), (0.006, 0.90)], length, height),
        ],
        widths,
        height,
    )
    tail, *_, bumper, front_high, _, _, rear_high = outline
    band = _scaled([(0.02, 0.4), (0.98, 0.4), (0.98, 0.81), (0.02, 0.81)], length, height)
    doors = _scaled([(0.0, 0.1), (1.0, 0.1), (1.0, 0.81), (0.0, 0.81)], length, height)
    right, left = side_faces(_leaning(band, widths, height))
    kerb_side, _ = side_faces(_leaning(doors, widths, height))
    front, rear = face_across(bumper, front_high, front=True), face_across(tail, rear_high, front=False)
    return [
        hull(outline, "paint"),
        box((0.12 * length, -0.35 * width, 0.91 * height), (0.42 * length, 0.35 * width, height), "paint"),
        pane(front, (0.04, 0.96), (0.18, 0.80), "glass"),
        pane(front, (0.2, 0.8), (0.85, 0.97), "trim"),  # the destination
        pane(rear, (0.1, 0.9), (0.45, 0.85), "glass"),
        *(pane(left, across, (0.02, 0.98), "glass") for across in ((0.03, 0.34), (0.35, 0.66), (0.67, 0.98))),
        *(pane(right, across, (0.02, 0.98), "glass") for across in ((0.02, 0.42), (0.55, 0.87))),
        *(pane(kerb_side, across, (0.03, 0.97), "glass") for across in ((0.435, 0.545), (0.885, 0.975))),
        *_lamps(front, (0.02, 0.13), rear, (0.1, 0.35), wide=0.2, rear_wide=0.1),
        *_pair(front_axle, width, radius),
        *(_twins(axle, width, radius) for axle in twins),
    ]


def _cab(length: float, cab: float, width: float, height: float, radius: float) -> list[Part]:
    """Return a forward-control cab of a length, over the front axle."""
    rear, axle = length - cab, length - 0.62 * cab
    floor, top = 0.8 * radius, 2.08 * radius
    reach = min(1.2 * radius, 0.36 * cab)
    widths = np.array([0.98, 0.90]) * width
    outline = _leaning(
        [
            (rear, top),
            (axle + 0.6 * reach, top),
            (axle + reach, floor),
            (length - 0.02 * cab, floor),
            (length, 0.24 * height),
            (length - 0.015 * cab, 0.50 * height),
            (length - 0.14 * cab, 0.93 * height),
            (length - 0.45 * cab, height),
            (rear, height),
        ],
        widths,
        height,
    )
    _, _, _, _, bumper, cowl, roof, _, _ = outline
    pillar = rear + 0.3 * cab
    doors = _leaning([(pillar, cowl[1]), (cowl[0], cowl[1]), (roof[0], roof[1]), (pillar, roof[1])], widths, height)
    front = face_across(bumper, cowl, front=True)
    return [
        hull(outline, "paint"),
        pane(face_across(cowl, roof, front=True), (0.05, 0.95), (0.06, 0.92), "glass"),
        *_windows(doors, [(0.1, 0.9)], (0.05, 0.88)),
        pane(front, (0.24, 0.76), (0.1, 0.95), "trim"),
        *_ends(front, (0.0, 0.3), 0.16, "headlamp"),
    ]


def _scaled(shares: Sequence[tuple[float, float]], length: float, height: float) -> list[tuple[float, float]]:
    """Return corners (x, z) in metres that are given in shares of a length and a height."""
    return [(x * length, z * height) for x, z in shares]


def _leaning(corners: Sequence[tuple[float, float]], widths: Float, height: float) -> Float:
    """Return an outline (k, 3) whose sides are flat: corners (x, z), and half the width that a height has.

    Parameters
    ----------
    widths : (2,) float64, metres
        On the ground and at ``height``.
    height : float, metres
    """
    outline = np.array(corners)
    width = widths[0] + (widths[1] - widths[0]) * outline[:, 1] / height
    return np.column_stack([outline, width / 2])


def _arches(axles: Sequence[float], radius: float, floor: float) -> list[tuple[float, float]]:
    """Return the corners (x, z) of the lower edge over the wheels, from rear to front."""
    top = 2.08 * radius
    shape = ((-1.2, floor), (-0.72, top), (0.72, top), (1.2, floor))
    return [(axle + share * radius, height) for axle in axles for share, height in shape]


def _windows(corners: Float, across: Sequence[tuple[float, float]], up: tuple[float, float]) -> list[Part]:
    """Return panes on both sides: `side_faces`, and what parts of them, from rear to front, the panes cover."""
    right, left = side_faces(corners)
    return [
        *(pane(right, (begin, end), up, "glass") for begin, end in across),
        *(pane(left, (1 - end, 1 - begin), up, "glass") for begin, end in across),
    ]


def _lamps(
    front: Float,
    up: tuple[float, float],
    rear: Float,
    rear_up: tuple[float, float],
    *,
    wide: float,
    rear_wide: float | None = None,
) -> list[Part]:
    return [*_ends(front, up, wide, "headlamp"), *_ends(rear, rear_up, rear_wide or wide, "tail lamp")]


def _ends(face: Float, up: tuple[float, float], wide: float, material: str) -> list[Part]:
    """Return a pane at either end of a face."""
    return [pane(face, across, up, material) for across in ((0.03, 0.03 + wide), (0.97 - wide, 0.97))]


def _pair(axle: float, width: float, radius: float) -> list[Part]:
    """Return the two wheels of an axle, each with its rim."""
    parts = []
    for side in (-1.0, 1.0):
        outer = side * 0.96 * width / 2
        parts += [wheel(axle, outer, outer - side * TYRE_SHARE * width, radius), rim(axle, outer, -side, radius)]
    return parts


def _twins(axle: float, width: float, radius: float) -> Part:
    """Return an axle with twin tyres, which leave so little between them that one roll stands for all."""
    return wheel(axle, -0.48 * width, 0.48 * width, radius)
