"""A small junction made by hand, with visibility by plain lines of sight in plan: for results, not for truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from seip_addon.core.choosing.placement.deployment import Deployment, deploy
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.site.scene_geometry import Mesh, NamedArea, Pole, SceneGeometry
from seip_addon.core.site.site import Candidates, Site, Targets

ORIGIN = np.array([5_000_000.0, -300_000.0, 120.0])
BUILDINGS = ((-38, -34, -14, -13, 12), (16, -30, 36, -14, 18), (-30, 14, -14, 40, 9), (14, 13, 40, 30, 24))
TREES = tuple((x, y) for x in (-44.0, -34.0, -24.0, 24.0, 34.0, 44.0) for y in (-9.2, 9.2))
SIGNAL_POLES = ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0))


@dataclass(frozen=True)
class Example:
    geometry: SceneGeometry
    site: Site
    models: dict[str, LidarModel]
    visible: np.ndarray
    deployment: Deployment


def box_triangles(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """Return the twelve triangles of a box."""
    corner = np.array([[(low, high)[(i >> k) & 1][k] for k in range(3)] for i in range(8)], dtype=float)
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return np.array([corner[list(t)] for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def flat_triangles(*boxes: tuple[float, float, float, float], z: float = 0.0) -> np.ndarray:
    """Return two triangles for each rectangle."""
    return np.array(
        [
            [(x, y, z) for x, y in corners]
            for a, b, c, d in boxes
            for corners in (((a, b), (c, b), (c, d)), ((a, b), (c, d), (a, d)))
        ],
        dtype=float,
    )


def make_example(spacing: float = 2.0, reach: float = 55.0, heights: tuple[float, ...] = (3.5, 5.4)) -> Example:
    """Return the junction with three poses chosen greedily."""
    geometry = make_geometry(reach)
    site = make_site(geometry, spacing, heights)
    models = load_catalogue()
    visible = lines_of_sight(site, models)
    chosen = greedy(site, visible, 3)
    return Example(geometry, site, models, visible, deploy(site, models, visible[chosen], chosen))


def greedy(site: Site, visible: np.ndarray, count: int) -> list[int]:
    """Return poses at different positions, each adding the most targets to those before it."""
    chosen: list[int] = []
    unseen = np.ones(visible.shape[1], bool)
    free = np.ones(len(visible), bool)
    for _ in range(count):
        chosen.append(int(np.argmax(np.where(free, (visible & unseen).sum(axis=1), -1))))
        unseen &= ~visible[chosen[-1]]
        free &= site.candidates.position_of != site.candidates.position_of[chosen[-1]]
    return chosen


def make_geometry(reach: float) -> SceneGeometry:
    roads = shapely.union_all([shapely.box(-reach, -7, reach, 7), shapely.box(-7, -reach, 7, reach)])
    wide = shapely.union_all([shapely.box(-reach, -10, reach, 10), shapely.box(-10, -reach, 10, reach)])
    road_mesh = flat_triangles((-reach, -7, reach, 7), (-7, -reach, 7, -7), (-7, 7, 7, reach))
    corners = [(s * 7, t * 7, s * reach, t * 10) for s in (-1, 1) for t in (-1, 1)]
    corners += [(s * 7, t * 10, s * 10, t * reach) for s in (-1, 1) for t in (-1, 1)]
    occluders = [
        Mesh(f"building {i}", box_triangles((a, b, 0), (c, d, h))) for i, (a, b, c, d, h) in enumerate(BUILDINGS)
    ]
    occluders += [
        Mesh(f"tree {i}", box_triangles((x - 1.6, y - 1.2, 2.5), (x + 1.6, y + 1.2, 7)))
        for i, (x, y) in enumerate(TREES)
    ]
    return SceneGeometry(
        name="Small junction",
        origin=ORIGIN,
        roads=(Mesh("carriageway", road_mesh),),
        ground=(Mesh("pavement", flat_triangles(*corners, z=0.12)),),
        occluders=tuple(occluders),
        region=roads,
        candidate_areas=wide - roads,
        weighted_regions=(NamedArea("central box", shapely.box(-12, -12, 12, 12), 2.0),),
        forbidden_areas=(NamedArea("driveway", shapely.box(20, 7, 30, 10)),),
        poles=tuple(Pole(f"signal pole {i}", np.array([x, y, 0.12])) for i, (x, y) in enumerate(SIGNAL_POLES)),
    )


def make_site(geometry: SceneGeometry, spacing: float, heights: tuple[float, ...]) -> Site:
    left, bottom, right, top = geometry.region.bounds
    x, y = np.meshgrid(np.arange(left, right, spacing) + spacing / 2, np.arange(bottom, top, spacing) + spacing / 2)
    x, y = x.ravel(), y.ravel()
    inside = shapely.contains_xy(geometry.region, x, y)
    xyz = np.stack((x[inside], y[inside], np.zeros(inside.sum())), axis=1)
    central = shapely.contains_xy(geometry.weighted_regions[0].polygon, xyz[:, 0], xyz[:, 1])
    triangles = np.concatenate([mesh.triangles for mesh in (*geometry.roads, *geometry.ground, *geometry.occluders)])
    return Site(
        name=geometry.name,
        origin=geometry.origin,
        region=geometry.region,
        targets=Targets(xyz, np.where(central, 2.0, 1.0), central, spacing),
        candidates=make_candidates(geometry, right, heights),
        triangles=triangles,
        reflectivity=np.full(len(triangles), 0.3),
    )


def make_candidates(geometry: SceneGeometry, reach: float, heights: tuple[float, ...]) -> Candidates:
    along = np.arange(-reach + 6, reach, 12.0)
    beside = [(x, s * 9.0) for x in along if abs(x) > 11 for s in (-1, 1)]
    beside += [(y, x) for x, y in beside]
    feet = np.array([*(pole.base for pole in geometry.poles), *((x, y, 0.12) for x, y in beside)])
    poles = len(geometry.poles)
    names = [pole.name for pole in geometry.poles] + [f"sidewalk {i}" for i in range(len(beside))]
    grid = [(p, h, key) for p in range(len(feet)) for h in heights for key in ("type1", "type2")]
    position_of = np.array([p for p, _, _ in grid])
    height = np.array([h for _, h, _ in grid])
    bracket = np.where(position_of < poles, 0.4, 0.0)
    yaw = np.where(position_of < poles, np.arctan2(-feet[position_of, 1], -feet[position_of, 0]), 0.0)
    offset = np.stack((bracket * np.cos(yaw), bracket * np.sin(yaw), height), axis=1)
    return Candidates(
        position=feet,
        position_name=np.array(names),
        on_pole=np.arange(len(feet)) < poles,
        pole_source=np.where(np.arange(len(feet)) < poles, "map", ""),
        position_of=position_of,
        sensor=np.array([key for _, _, key in grid]),
        height=height,
        xyz=feet[position_of] + offset,
        yaw=yaw,
        tilt=np.zeros(len(grid)),
        mandatory=np.zeros((0, len(feet)), bool),
        mandatory_name=np.array([], dtype=np.str_),
        dropped={"inside an object": 2},
    )


def lines_of_sight(site: Site, models: dict[str, LidarModel]) -> np.ndarray:
    """Return which pose sees which target when obstacles are endless in height and ranges a sixth."""
    trunks = [shapely.box(x - 0.8, y - 0.6, x + 0.8, y + 0.6) for x, y in TREES]
    walls = shapely.union_all([*(shapely.box(a, b, c, d) for a, b, c, d, _ in BUILDINGS), *trunks])
    shapely.prepare(walls)
    eyes, targets = site.candidates.xyz[:, :2], site.targets.xyz[:, :2]
    ranges = np.array([models[key].max_range for key in site.candidates.sensor]) / 6
    visible = np.empty((len(eyes), len(targets)), bool)
    for row, eye, most in zip(visible, eyes, ranges, strict=True):
        row[:] = np.hypot(*(targets - eye).T) < most
        ends = targets[row]
        lines = shapely.linestrings(np.stack((np.broadcast_to(eye, ends.shape), ends), axis=1))
        row[np.flatnonzero(row)[shapely.intersects(walls, lines)]] = False
    return visible
