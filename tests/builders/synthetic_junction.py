"""A four-arm junction of boxes, cylinders and spheres: a site to test and to time with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from shapely import box

from seip_addon.core.site.site import Candidates, Site, Targets

Float = NDArray[np.float64]


def rectangle(low: tuple[float, float], high: tuple[float, float], z: float = 0.0, step: float = 2.0) -> Float:
    """Level rectangle of squares of two triangles, (n, 3, 3)."""
    x, y = (np.linspace(u, v, max(2, round((v - u) / step) + 1)) for u, v in zip(low, high, strict=True))
    a, b = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij")
    a, b = a.ravel(), b.ravel()

    def corner(i: int, j: int) -> Float:
        return np.stack([x[a + i], y[b + j], np.full(len(a), z)], axis=1)

    one = np.stack([corner(0, 0), corner(1, 0), corner(1, 1)], axis=1)
    other = np.stack([corner(0, 0), corner(1, 1), corner(0, 1)], axis=1)
    return np.concatenate([one, other])


def prism(foot: tuple[float, float], radius: float, top: float, sides: int = 16, turn: float = 0.0) -> Float:
    """Upright prism without its floor, (n, 3, 3)."""
    angle = turn + np.arange(sides + 1) * 2 * np.pi / sides
    ring = np.stack([foot[0] + radius * np.cos(angle), foot[1] + radius * np.sin(angle)], axis=1)
    low = np.column_stack([ring, np.zeros(sides + 1)])
    high = np.column_stack([ring, np.full(sides + 1, top)])
    middle = np.broadcast_to([*foot, top], (sides, 3))
    return np.concatenate(
        [
            np.stack([low[:-1], low[1:], high[1:]], axis=1),
            np.stack([low[:-1], high[1:], high[:-1]], axis=1),
            np.stack([high[:-1], high[1:], middle], axis=1),
        ]
    )


def sphere(centre: Float, radius: float, rows: int = 10, columns: int = 16) -> Float:
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rows + 1)
    longitude = np.linspace(0, 2 * np.pi, columns + 1)
    la, lo = np.meshgrid(latitude, longitude, indexing="ij")
    grid = np.stack([np.cos(la) * np.cos(lo), np.cos(la) * np.sin(lo), np.sin(la)], axis=-1) * radius + centre
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )


def varied_reflectivity(triangles):
    """A reflectivity for each triangle, whatever its neighbours have, that follows from its corners."""
    return 0.05 + 0.9 * np.modf(np.abs(triangles.sum(axis=(1, 2))) * 7.13)[0]


def junction_site(
    positions: int = 150,
    sensors: Sequence[str] = ("type1", "type2", "type3"),
    heights: Sequence[float] = (3.5, 5.4, 8.0),
    spacing: float = 1.0,
) -> Site:
    arm = 80.0
    half = 7.0
    parts = [
        rectangle((-arm, -half), (arm, half)),
        rectangle((-half, half), (half, arm)),
        rectangle((-half, -arm), (half, -half)),
    ]
    for sx in (-1, 1):
        for sy in (-1, 1):
            x0, x1 = sorted((sx * half, sx * arm))
            y0, y1 = sorted((sy * half, sy * arm))
            parts.append(rectangle((x0, y0), (x1, y1), z=0.12, step=6.0))
            for k in range(3):  # a row of houses with gaps along each street
                parts.append(prism((sx * (20 + 24 * k), sy * 21), 11.0, 14.0, sides=4, turn=np.pi / 4))
                parts.append(prism((sx * 21, sy * (20 + 24 * k)), 11.0, 14.0, sides=4, turn=np.pi / 4))
            for k in range(6):  # trees by the kerb
                for x, y in ((sx * (16 + 11 * k), sy * 9.0), (sx * 9.0, sy * (16 + 11 * k))):
                    parts.append(prism((x, y), 0.15, 2.6, sides=8))
                    parts.append(sphere(np.array([x, y, 4.2]), 1.8))
            parts.append(prism((sx * 8.0, sy * 8.0), 0.12, 6.0))
    triangles = np.concatenate(parts)

    line = np.arange(-arm + spacing / 2, arm, spacing)
    x, y = (v.ravel() for v in np.meshgrid(line, line))
    road = (np.abs(x) < half) | (np.abs(y) < half)
    target = np.column_stack([x[road], y[road], np.zeros(road.sum())])
    central = (np.abs(target[:, :2]) < 12).all(axis=1)

    per_side = -(-positions // 8)
    along = np.linspace(10.3, arm - 3, per_side)
    ground = np.concatenate(
        [
            np.column_stack([sx * u, sy * v])
            for sx in (-1, 1)
            for sy in (-1, 1)
            for u, v in ((along, np.full(per_side, 7.7)), (np.full(per_side, 7.7), along))
        ]
    )[:positions]
    ground = np.column_stack([ground, np.full(len(ground), 0.12)])
    p, h, s = (v.ravel() for v in np.meshgrid(np.arange(len(ground)), heights, np.arange(len(sensors)), indexing="ij"))
    return Site(
        name="junction",
        origin=np.zeros(3),
        region=box(-arm, -arm, arm, arm),
        targets=Targets(target, np.ones(len(target)), central, spacing),
        candidates=make_candidates(ground[p] + np.column_stack([0 * h, 0 * h, h]), np.asarray(sensors)[s], h),
        triangles=triangles,
        reflectivity=varied_reflectivity(triangles),
    )


def make_candidates(
    xyz: Float,
    sensor: Sequence[str] | NDArray[np.str_],
    height: Float,
    yaw: Float | None = None,
    tilt: Float | None = None,
) -> Candidates:
    count = len(xyz)
    return Candidates(
        position=xyz - np.column_stack([np.zeros(count), np.zeros(count), height]),
        position_name=np.array([f"sidewalk {i}" for i in range(count)]),
        on_pole=np.zeros(count, dtype=bool),
        pole_source=np.full(count, ""),
        position_of=np.arange(count),
        sensor=np.asarray(sensor, dtype=np.str_),
        height=np.asarray(height, dtype=np.float64),
        xyz=xyz,
        yaw=np.zeros(count) if yaw is None else yaw,
        tilt=np.zeros(count) if tilt is None else tilt,
        mandatory=np.zeros((0, count), dtype=bool),
        mandatory_name=np.zeros(0, dtype=np.str_),
        dropped={},
    )
