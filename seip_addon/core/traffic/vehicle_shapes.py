"""Cars, vans, trucks and buses out of few triangles, rear bumper at x = 0.

The proportions are those of European vehicles of the class, read off makers' dimension sheets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Float
from .body_parts import Part, box, face_across, hull, pane, rim, side_faces, skin, wheel

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
    scale = np.array([length, height, width / 2])
    radius = min(0.215 * height, 0.078 * length)
    axles = (form.rear_axle * length, form.front_axle * length)
    belt, floor = form.belt, form.floor
    front_low, bumper, nose = _scaled([(0.975, 1.25 * floor, 0.86), (1.0, 0.33, 0.86), (0.972, 0.49, 0.88)], scale)
    tail, edge = _scaled([(0.0, 0.34, 0.88), (0.012, belt, 0.91)], scale)
    lower = [
        *_scaled([(0.02, 1.35 * floor, 0.88)], scale),
        *_arches(axles, radius, floor * height, 0.97 * width / 2),
        front_low,
        bumper,
        nose,
        *_scaled([(form.windscreen[0] + 0.02, belt - 0.005, 0.94)], scale),
        edge,
        tail,
    ]
    roof_front, roof_rear = form.windscreen[1], form.rear_window[0]
    rear_low, front_base, front_high, crown, rear_high = cabin = _scaled(
        [
            (form.rear_window[1], belt - 0.02, 0.88),
            (form.windscreen[0], belt - 0.02, 0.90),
            (roof_front, 0.965, 0.70),
            ((roof_front + roof_rear) / 2, 1.0, 0.69),
            (roof_rear, 0.965, 0.68),
        ],
        scale,
    )
    del crown
    sides = side_faces(np.array([rear_low, front_base, front_high, rear_high]))
    return [
        hull(np.array(lower), "paint"),
        hull(cabin, "paint"),
        pane(face_across(front_base, front_high, front=True), (0.05, 0.95), (0.10, 0.94), "glass"),
        pane(face_across(rear_low, rear_high, front=False), (0.08, 0.92), (0.14, 0.90), "glass"),
        *_windows(sides, [(0.11, 0.47), (0.53, 0.89)], (0.17, 0.86)),
        *_lamps(face_across(bumper, nose, front=True), face_across(tail, edge, front=False), up=(0.45, 0.9)),
        pane(face_across(front_low, bumper, front=True), (0.2, 0.8), (0.25, 0.9), "trim"),
        *_wheels(axles, width, radius),
    ]


def van(length: float, width: float, height: float) -> list[Part]:
    """Return a panel van: a short bonnet, a steep windscreen, and a box behind the seats."""
    scale = np.array([1.0, height, width / 2])
    radius = min(0.135 * height, 0.065 * length)
    bonnet = min(0.17 * length, 1.0)
    screen = min(0.10 * length, 0.75)
    axles = (min(0.2 * length, 1.15), length - min(0.2 * length, 0.95))
    floor = 0.10
    front_low, bumper, nose = _scaled(
        [(0.985 * length, 1.1 * floor, 0.90), (length, 0.22, 0.90), (length - 0.1 * bonnet, 0.40, 0.88)], scale
    )
    cowl, roof_front = _scaled(
        [(length - bonnet, 0.51, 0.92), (length - bonnet - screen, 0.94, 0.82)],
        scale,
    )
    tail, rear_high = _scaled([(0.0, 0.22, 0.95), (0.01 * length, 0.97, 0.83)], scale)
    outline = [
        *_scaled([(0.01 * length, 1.2 * floor, 0.95)], scale),
        *_arches(axles, radius, floor * height, 0.97 * width / 2),
        front_low,
        bumper,
        nose,
        cowl,
        roof_front,
        *_scaled([(0.6 * length, 1.0, 0.81)], scale),
        rear_high,
        tail,
    ]
    door = max(0.5 * length, cowl[0] - 1.5)
    doors = side_faces(
        np.array(
            [
                (door, 0.51 * height, 0.92 * width / 2),
                (cowl[0], 0.51 * height, 0.915 * width / 2),
                (roof_front[0], 0.93 * height, 0.822 * width / 2),
                (door, 0.93 * height, 0.822 * width / 2),
            ]
        )
    )
    rear = face_across(tail, rear_high, front=False)
    return [
        hull(np.array(outline), "paint"),
        pane(face_across(cowl, roof_front, front=True), (0.05, 0.95), (0.06, 0.9), "glass"),
        *_windows(doors, [(0.15, 0.93)], (0.06, 0.82)),
        pane(rear, (0.10, 0.46), (0.45, 0.85), "glass"),
        pane(rear, (0.54, 0.90), (0.45, 0.85), "glass"),
        *_lamps(face_across(bumper, nose, front=True), rear, up=(0.45, 0.95), rear_up=(0.1, 0.4), rear_wide=0.1),
        pane(face_across(bumper, nose, front=True), (0.32, 0.68), (0.3, 0.8), "trim"),
        *_wheels(axles, width, radius),
    ]


def truck(length: float, width: float, height: float) -> list[Part]:
    """Return a cab and a box behind it: a rigid truck, or from `LONG_TRUCK` on a tractor and its semi-trailer."""
    articulated = length >= LONG_TRUCK
    radius = min(0.52, 0.15 * height, 0.06 * length)
    cab_length = min(0.28 * length, 2.2)
    rear_of_cab = length - cab_length
    gap = (0.4 if articulated else 0.08) * cab_length
    bed = min(0.30 * height, 1.2)
    half = width / 2
    front_axle = length - 0.62 * cab_length
    if articulated:
        twin_axles = [rear_of_cab - 0.75 * cab_length, *(0.16 * length + np.array([-2.6, 0.0, 2.6]) * radius)]
    else:
        twin_axles = [0.22 * length]
    cargo = rear_of_cab - gap
    return [
        *_cab(length, cab_length, half, (0.93 if articulated else 0.80) * height, radius),
        box((0.0, -half, bed), (cargo, half, height), "cargo box"),
        box((0.004 * length, -0.42 * half, 0.9 * radius), (length - 0.3 * cab_length, 0.42 * half, bed + 0.02), "trim"),
        box((0.0, -0.9 * half, 0.38 * bed), (0.02 * length, 0.9 * half, 0.62 * bed), "trim"),  # underrun bar
        *(
            pane(_tail_face(half, bed), across, (0.1, 0.9), "tail lamp")
            for across in ((0.04, 0.2), (0.8, 0.96))
        ),
        *_pair(front_axle, width, radius),
        *(wheel(float(axle), -0.98 * half, 0.98 * half, radius) for axle in twin_axles),
    ]


def bus(length: float, width: float, height: float) -> list[Part]:
    """Return a low-floor city bus: large panes, doors on the right-hand side."""
    half = width / 2
    scale = np.array([length, height, half])
    radius = min(0.5, 0.155 * height, 0.05 * length)
    axles = [min(0.28 * length, 3.4), length - min(0.23 * length, 2.7)]
    twin = [axles[0]] if length < LONG_BUS else [axles[0], axles[0] + 3.0 * radius]
    floor = 0.09
    tail, rear_high = _scaled([(0.0, 0.2, 0.985), (0.006, 0.96, 0.95)], scale)
    front_low, bumper, front_high = _scaled([(0.992, floor, 0.95), (1.0, 0.3, 0.96), (0.982, 0.95, 0.93)], scale)
    outline = [
        *_scaled([(0.006, 1.3 * floor, 0.985)], scale),
        *_arches((*twin, axles[1]), radius, floor * height, 0.985 * half),
        front_low,
        bumper,
        front_high,
        *_scaled([(0.95, 1.0, 0.93), (0.02, 1.0, 0.93)], scale),
        rear_high,
        tail,
    ]
    belt, top = 0.40 * height, 0.86 * height
    right, left = side_faces(
        np.array(
            [
                (0.02 * length, belt, half * 0.977),
                (0.985 * length, belt, half * 0.962),
                (0.98 * length, top, half * 0.94),
                (0.02 * length, top, half * 0.952),
            ]
        )
    )
    doors = side_faces(np.array([(0.0, 0.1, 0.98), (1.0, 0.1, 0.965), (1.0, 0.86, 0.937), (0.0, 0.86, 0.953)]) * scale)[0]
    front = face_across(bumper, front_high, front=True)
    rear = face_across(tail, rear_high, front=False)
    return [
        hull(np.array(outline), "paint"),
        pane(front, (0.04, 0.96), (0.18, 0.80), "glass"),
        pane(front, (0.2, 0.8), (0.85, 0.97), "trim"),  # destination sign
        pane(rear, (0.1, 0.9), (0.45, 0.85), "glass"),
        *(pane(left, across, (0.02, 0.98), "glass") for across in ((0.03, 0.32), (0.34, 0.64), (0.66, 0.97))),
        *(pane(right, across, (0.02, 0.98), "glass") for across in ((0.03, 0.41), (0.55, 0.86))),
        *(pane(doors, across, (0.03, 0.97), "glass") for across in ((0.43, 0.53), (0.885, 0.975))),
        *_lamps(front, rear, up=(0.02, 0.13), rear_up=(0.1, 0.35), rear_wide=0.1),
        *_pair(axles[1], width, radius),
        *(wheel(axle, -0.98 * half, 0.98 * half, radius) for axle in twin),
    ]


def _cab(length: float, cab_length: float, half: float, height: float, radius: float) -> list[Part]:
    """Return a forward-control cab with its front wheel arch."""
    rear, axle = length - cab_length, length - 0.62 * cab_length
    floor = 0.8 * radius
    front_low, bumper, cowl, roof = (
        np.array(corner)
        for corner in (
            (length - 0.02 * cab_length, floor, 0.97 * half),
            (length, 0.24 * height, 0.97 * half),
            (length - 0.015 * cab_length, 0.50 * height, 0.97 * half),
            (length - 0.14 * cab_length, 0.93 * height, 0.90 * half),
        )
    )
    reach = min(1.2 * radius, 0.36 * cab_length)
    top = 2.08 * radius
    outline = [
        (rear, top, 0.95 * half),
        (axle - 0.6 * reach, top, 0.97 * half),
        (axle + 0.6 * reach, top, 0.97 * half),
        (axle + reach, floor, 0.97 * half),
        front_low,
        bumper,
        cowl,
        roof,
        (length - 0.45 * cab_length, height, 0.88 * half),
        (rear, height, 0.88 * half),
    ]
    front = face_across(bumper, cowl, front=True)
    doors = side_faces(
        np.array(
            [
                (rear + 0.30 * cab_length, 0.50 * height, 0.963 * half),
                (cowl[0], 0.50 * height, 0.970 * half),
                (roof[0], 0.90 * height, 0.905 * half),
                (rear + 0.30 * cab_length, 0.90 * height, 0.895 * half),
            ]
        )
    )
    return [
        hull(np.array(outline), "paint"),
        pane(face_across(cowl, roof, front=True), (0.05, 0.95), (0.06, 0.92), "glass"),
        *_windows(doors, [(0.1, 0.9)], (0.08, 0.9)),
        pane(front, (0.24, 0.76), (0.1, 0.95), "trim"),
        *(pane(front, across, (0.0, 0.3), "headlamp") for across in ((0.04, 0.2), (0.8, 0.96))),
    ]


def _tail_face(half: float, bed: float) -> Float:
    """Return the rear face (4, 3) of a truck's underrun bar."""
    corner = np.array([0.0, 0.38 * bed, 0.9 * half])
    return face_across(corner, corner + [0.0, 0.24 * bed, 0.0], front=False)


def _windows(
    faces: tuple[Float, Float], across: list[tuple[float, float]], up: tuple[float, float]
) -> list[Part]:
    """Return panes on a face of the right side, along it from rear to front, and their mirror images."""
    right, left = faces
    return [
        *(pane(right, (begin, end), up, "glass") for begin, end in across),
        *(pane(left, (1 - end, 1 - begin), up, "glass") for begin, end in across),
    ]


def _lamps(
    front: Float,
    rear: Float,
    up: tuple[float, float],
    rear_up: tuple[float, float] = (0.5, 0.92),
    rear_wide: float = 0.22,
) -> list[Part]:
    """Return a pair of headlamps and a pair of tail lamps at the outer ends of two faces."""
    ends = ((0.03, 0.25), (0.75, 0.97))
    rear_ends = ((0.02, 0.02 + rear_wide), (0.98 - rear_wide, 0.98))
    return [
        *(pane(front, across, up, "headlamp") for across in ends),
        *(pane(rear, across, rear_up, "tail lamp") for across in rear_ends),
    ]


def _arches(axles: tuple[float, ...], radius: float, floor: float, half: float) -> list[Float]:
    """Return the corners of the lower edge over the wheels, from rear to front."""
    top = 2.08 * radius
    corners = [
        (axle + share * radius, height, half)
        for axle in axles
        for share, height in ((-1.2, floor), (-0.72, top), (0.72, top), (1.2, floor))
    ]
    return [np.array(corner) for corner in corners]


def _wheels(axles: tuple[float, float], width: float, radius: float) -> list[Part]:
    return [part for axle in axles for part in _pair(axle, width, radius)]


def _pair(axle: float, width: float, radius: float) -> list[Part]:
    """Return the two wheels of an axle, each with its rim."""
    parts = []
    for side in (-1.0, 1.0):
        outer = side * 0.96 * width / 2
        parts += [wheel(axle, outer, outer - side * TYRE_SHARE * width, radius), rim(axle, outer, -side, radius)]
    return parts


def _scaled(corners: list[tuple[float, float, float]], scale: Float) -> Float:
    return np.array(corners) * scale
