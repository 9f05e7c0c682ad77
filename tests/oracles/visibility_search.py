"""Random scenes whose visibility grids are held to two references: the full scan, and arithmetic written here."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.model import DetectionLaw, LidarModel
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.near_surfaces import caster_tolerance
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import Engine, VisibilitySettings
from seip_addon.core.site.candidates import Candidates
from seip_addon.core.site.site import Site, Targets
from tests.oracles.full_scan import full_scan

Float = NDArray[np.float64]
Boolean = NDArray[np.bool_]

ROUNDINGS = 16
"""So many roundings to float32 lie between the coordinates of a scene and a ray's return: storing corners, origin and
direction, their differences, two products and a sum of each edge function, and the quotient that is the distance."""
HALF_STEP = 2.0**-24
"""Largest relative error of one rounding to float32."""


@dataclass(frozen=True, eq=False)
class Case:
    site: Site
    models: dict[str, LidarModel]
    settings: VisibilitySettings
    kind: str


@dataclass(frozen=True, eq=False)
class Verdict:
    """What float64 says of each entry of a grid, (c, t): certainly seen, and left open by the roundings of float32."""

    seen: Boolean
    undecided: Boolean


# ---- scenes ----------------------------------------------------------------------------------------------------------


def draw_case(seed: int) -> Case:
    random = np.random.default_rng((8, seed))
    delta = float(random.choice([0.3, 1.0, 3.0, np.exp(random.uniform(np.log(0.3), np.log(3.0)))]))
    half = float(random.choice([8.0, 15.0, 15.0, 60.0]))
    kind = str(random.choice(list(KINDS)))
    triangles = KINDS[kind](random, half, delta)
    if random.random() < 0.2:  # something far off shifts the middle and widens the tolerance
        far = np.append(random.uniform(-20, 20, 2) * half, 0.0)
        triangles = np.concatenate([triangles, (far + random.normal(0, 1, (3, 3)))[None]])
    if random.random() < 0.4:  # faces upon faces, as a marking lies upon a road
        triangles = np.concatenate([triangles, _upon(random, triangles)])
    if random.random() < 0.5:  # as Blender keeps them
        triangles = triangles.astype(np.float32).astype(np.float64)
    models = {key: _model(random, key, half) for key in ("one", "two")}
    if random.random() < 0.6:  # one, both or none of them look one way, some of them with channels of the other
        models = _looking_one_way(random, models)
    targets = _targets(random, triangles, delta, 60)
    return Case(
        Site(
            name=f"{kind} {seed}",
            origin=np.zeros(3),
            region=shapely.box(-half, -half, half, half),
            targets=Targets(targets, np.ones(len(targets)), np.zeros(len(targets), dtype=bool), 1.0),
            candidates=_poses(random, triangles, targets, half, list(models)),
            triangles=triangles,
            reflectivity=_reflectivity(random, triangles),
        ),
        models,
        VisibilitySettings(
            delta, float(random.choice([0.0, 0.0, random.uniform(0, 0.9)])), float(random.uniform(0.05, 0.95))
        ),
        kind,
    )


def _soup(random: np.random.Generator, half: float, delta: float) -> Float:
    """Triangles of all slopes and sizes, some of them thin."""
    size = 10 ** random.uniform(-2, 1, (50, 1, 1))
    faces = random.uniform(-half, half, (50, 1, 3)) * (1, 1, 0.2) + size * random.normal(0, 1, (50, 3, 3))
    thin = random.random(50) < 0.1
    share = random.uniform(0, 1, (50, 1))
    along = faces[:, 0] * share + faces[:, 1] * (1 - share) + random.normal(0, 0.01, (50, 3))
    faces[thin, 2] = along[thin]
    return faces


def _level(random: np.random.Generator, half: float, delta: float) -> Float:
    """Level faces, some broad and some small, at heights as files hold them."""
    count = int(random.integers(1, 12))
    size = random.choice([0.5, 2.0, half, 2 * half], (count, 1, 1))
    faces = random.uniform(-half, half, (count, 1, 3)) * (1, 1, 0) + size * random.normal(0, 1, (count, 3, 3))
    faces[:, :, 2] = np.round(random.uniform(-1.5 * delta, 1.5 * delta, (count, 1)), int(random.integers(1, 9)))
    return faces


def _steps(random: np.random.Generator, half: float, delta: float) -> Float:
    """A road with a grade between level verges, and walls across."""
    x = np.sort(random.uniform(-half, half, 2))
    edges = [-2 * half, x[0], x[1], 2 * half]
    heights = np.round(random.normal(0, 0.3 * delta, 4), 3)
    grade = random.choice([0.0, 0.01, random.normal(0, 0.1), random.normal(0, 1.0)])
    parts = []
    for strip in range(3):
        low, high = edges[strip], edges[strip + 1]
        slope = grade if strip == 1 else 0.0
        corners = [
            [u, v, heights[strip] + slope * v] for u, v in ((low, -half), (high, -half), (high, half), (low, half))
        ]
        parts += [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
    for _ in range(int(random.integers(0, 4))):
        foot, along = random.uniform(-half, half, 2), random.normal(0, 3, 2)
        a, b = np.append(foot, -2.0), np.append(foot + along, -2.0)
        up = np.array([0, 0, random.uniform(2, 6)])
        parts += [[a, b, b + up], [a, b + up, a + up]]
    return np.array(parts, dtype=np.float64)


def _tilted(random: np.random.Generator, half: float, delta: float) -> Float:
    """Parallel faces of one slope, one above the other."""
    count = int(random.integers(1, 10))
    slope = random.normal(0, random.choice([1e-9, 1e-4, 0.05, 1.0, 30.0]), 2)
    faces = random.uniform(-half, half, (count, 1, 3)) * (1, 1, 0) + random.choice([1.0, half]) * random.normal(
        0, 1, (count, 3, 3)
    )
    faces[:, :, 2] = faces[:, :, :2] @ slope + random.uniform(-1.5 * delta, 1.5 * delta, (count, 1))
    return faces


def _grazed(random: np.random.Generator, half: float, delta: float) -> Float:
    """Faces through or close to one point, about which sensors hang too: rays run along them."""
    count = int(random.integers(1, 10))
    faces = random.normal(0, 1, (count, 3, 3)) * random.choice([0.5, 3.0, half], (count, 1, 1))
    level = random.random(count) < 0.5
    faces[level, :, 2] = random.normal(0, 10.0 ** random.uniform(-6, -1), (int(level.sum()), 1))
    return faces


KINDS = {"soup": _soup, "level": _level, "steps": _steps, "tilted": _tilted, "grazed": _grazed}


def _upon(random: np.random.Generator, triangles: Float) -> Float:
    """Copies of some faces, and parts of others in the same plane."""
    some = triangles[random.random(len(triangles)) < 0.5]
    whole = random.random(len(some)) < 0.5
    corners = np.einsum("nij,njk->nik", random.dirichlet((0.3, 0.3, 0.3), (len(some), 3)), some)
    corners[whole] = some[whole][:, [1, 2, 0]]
    return corners


def _reflectivity(random: np.random.Generator, triangles: Float) -> Float:
    """One for all, a few different ones, or one for each."""
    count = len(triangles)
    several = random.choice(random.uniform(0.0, 1.0, 3), count)
    reflectivity = [np.full(count, random.uniform(0.05, 1.0)), several, random.uniform(0.0, 1.0, count)]
    return reflectivity[int(random.integers(3))]


def _law(random: np.random.Generator, half: float) -> DetectionLaw:
    """CARLA's, or a range equation whose ranges are within the scene, beyond it, or hardly any."""
    if random.random() < 0.4:
        return CarlaDropoff()
    far = half * float(10.0 ** random.uniform(-1.0, 1.0))
    return RangeEquation.of_ranges(far, far * float(random.uniform(1.3, 2.8)), float(random.uniform(0.3, 0.95)))


def _model(random: np.random.Generator, key: str, half: float) -> LidarModel:
    channels, steps = int(random.integers(1, 25)), int(random.integers(1, 240))
    spread = random.choice([1.5, 0.5, 0.1])
    elevations = random.uniform(-spread, spread, channels)
    special = random.random(channels) < 0.15
    elevations[special] = random.choice([0.0, -0.0, 1e-9, -1e-9, -1.55, 1.55], int(special.sum()))
    return LidarModel(
        key=key,
        name=key,
        manufacturer="none",
        source="none",
        elevations=elevations,
        min_range=float(random.choice([0.0, 0.5, random.uniform(0, half / 2)])),
        max_range=float(random.choice([half / 2 + 1, 2 * half, 400.0])),
        points_per_second=10.0 * channels * steps,
        rotation_rate=10.0,
        price_range=(1.0, 2.0),
        azimuth_offsets=random.uniform(-7, 7, channels) * (random.random() < 0.7),
        law=_law(random, half),
    )


def _looking_one_way(random: np.random.Generator, models: dict[str, LidarModel]) -> dict[str, LidarModel]:
    """Limit fields of view: at times of models whose channels are equal, or to all but a step of the circle."""
    if random.random() < 0.3:
        models["two"] = replace(models["one"], key="two")
    for key, model in models.items():
        count = max(1, round(model.points_per_second / model.rotation_rate / len(model.elevations)))
        degrees = [random.uniform(1, 359), float(random.choice([1.0, 90.0, 120.0, 180.0, 270.0, 359.0])), 360.0]
        degrees.append(360.0 - 360.0 / (count + 1))
        models[key] = replace(model, field_of_view=math.radians(random.choice(degrees)))
    return models


def _targets(random: np.random.Generator, triangles: Float, delta: float, count: int) -> Float:
    """Points at every offset from the faces: up, down and across, some of them δ away but for rounding."""
    which = random.integers(0, len(triangles), count)
    point = (triangles[which] * random.dirichlet([1, 1, 1], count)[:, :, None]).sum(axis=1)
    normal = np.cross(triangles[which, 1] - triangles[which, 0], triangles[which, 2] - triangles[which, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0, normal / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))
    upright = random.random((count, 1)) < 0.5
    offset = random.uniform(-1.1, 1.1, (count, 1)) * delta
    offset[random.random(count) < 0.2] *= 1e-3
    offset[random.random(count) < 0.05] = 0.0
    aside = random.normal(0, 0.3 * delta, (count, 3)) * (random.random((count, 1)) < 0.3)
    xyz = point + offset * np.where(upright, (0.0, 0.0, 1.0), normal) + aside
    rounded = random.random(count) < 0.5
    xyz[rounded] = np.round(xyz[rounded], 6)
    return xyz


def _poses(random: np.random.Generator, triangles: Float, targets: Float, half: float, models: list[str]) -> Candidates:
    """All models at each of six places: free ones, ones close to faces, and ones by targets."""
    places = 6
    xyz = random.uniform((-half, -half, 0), (half, half, 8), (places, 3))
    xyz[3] = targets[random.integers(len(targets))] + (0.0, 0.0, random.choice([-1e-3, 1e-3, 0.0]))
    xyz[0] = random.normal(0, 1, 3) * (1, 1, 10.0 ** random.uniform(-5, 0))
    centre = triangles[random.integers(len(triangles))].mean(axis=0)
    xyz[1] = centre + random.normal(0, 1, 3) * 10.0 ** random.uniform(-3, 1)
    xyz[2] = targets[random.integers(len(targets))] + random.normal(0, 0.5, 3)
    if random.random() < 0.5:
        xyz = np.round(xyz, 6)
    yaw = random.uniform(-math.pi, math.pi, places)
    tilt = np.radians(random.choice([0.0, 0.01, 5.0, 45.0, 89.0, -30.0, random.uniform(-89, 89)], places))
    both = np.repeat(np.arange(places), len(models))
    return Candidates(
        position=xyz[both],
        position_name=np.array([f"place {i}" for i in both]),
        on_pole=np.zeros(len(both), dtype=bool),
        pole_source=np.full(len(both), ""),
        position_of=both,
        sensor=np.array(models * places),
        height=xyz[both, 2],
        xyz=xyz[both],
        yaw=yaw[both],
        tilt=tilt[both],
        mandatory=np.zeros((0, places), dtype=bool),
        mandatory_name=np.zeros(0, dtype=np.str_),
        dropped={},
    )


# ---- the oracle ------------------------------------------------------------------------------------------------------


def assess(case: Case) -> Verdict:
    """Cast every ray of every pose in float64, and keep open what float32 may decide otherwise."""
    poses = case.site.candidates
    rows = [
        _assess_pose(case, poses.xyz[pose], float(poses.yaw[pose]), float(poses.tilt[pose]), case.models[key])
        for pose, key in enumerate(poses.sensor.tolist())
    ]
    seen, possible = (np.array(part) for part in zip(*rows, strict=True))
    return Verdict(seen, possible & ~seen)


def _rays(model: LidarModel, yaw: float, tilt: float) -> Float:
    """Unit directions of one frame, each from its own angles, turned about y by the tilt and then about z."""
    count = max(1, round(model.points_per_second / model.rotation_rate / len(model.elevations)))
    column = np.arange(count) * (2 * math.pi / count)
    if model.field_of_view < 2 * math.pi:
        column = ((2 * np.arange(count) + 1) / (2 * count) - 0.5) * model.field_of_view
    azimuth = model.azimuth_offsets[:, None] + column
    level = np.cos(model.elevations)[:, None]
    x, y = level * np.cos(azimuth), level * np.sin(azimuth)
    z = np.broadcast_to(np.sin(model.elevations)[:, None], x.shape)
    return _turned(np.stack([x, y, z], axis=-1).reshape(-1, 3), yaw, tilt)


def _turned(rays: Float, yaw: float, tilt: float) -> Float:
    x, y, z = rays.T
    ahead, up = math.cos(tilt) * x + math.sin(tilt) * z, math.cos(tilt) * z - math.sin(tilt) * x
    turned = (math.cos(yaw) * ahead - math.sin(yaw) * y, math.sin(yaw) * ahead + math.cos(yaw) * y, up)
    return np.stack(turned, axis=1)


def _assess_pose(case: Case, origin: Float, yaw: float, tilt: float, model: LidarModel) -> tuple[Boolean, Boolean]:
    triangles, targets = case.site.triangles, case.site.targets.xyz
    delta = case.settings.delta
    points = triangles.reshape(-1, 3)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    width = max(np.abs(points - middle).max(), np.abs(origin - middle).max(), np.abs(points - origin).max())
    noise = ROUNDINGS * HALF_STEP * float(width)

    rays = _rays(model, yaw, tilt)
    ray, triangle, certain, begin, end = _hits(rays, triangles - origin, noise)
    # what may be met first: all that begins before something that is certainly met ends
    limit = np.full(len(rays), np.inf)
    np.minimum.at(limit, ray[certain], end[certain])
    first = begin <= limit[ray]
    ray, triangle, certain, begin, end = (part[first] for part in (ray, triangle, certain, begin, end))

    a, b, c = np.moveaxis(triangles[triangle], 1, 0)
    normal = np.cross(b - a, c - a)
    cosine = np.abs((normal * rays[ray]).sum(axis=1)) / np.linalg.norm(normal, axis=1)
    reflected = case.site.reflectivity[triangle] * cosine
    surely = (begin >= model.min_range + noise) & (end <= model.max_range - noise)
    maybe = (end >= model.min_range - noise) & (begin <= model.max_range + noise)
    surely &= _is_strong(model, case.settings, end, reflected * (1 - 1e-9))
    surely[surely] &= ~_beside_weaker(case, model, origin, rays[ray[surely]], begin[surely], end[surely])
    maybe &= _is_strong(model, case.settings, begin, reflected * (1 + 1e-9))
    # distances of targets from the stretch of each ray in which its return lies: of both ends, and least
    start = (origin + begin[:, None] * rays[ray])[:, None] - targets
    stop = (origin + end[:, None] * rays[ray])[:, None] - targets
    way = -(start * rays[ray][:, None]).sum(axis=2)
    foot = start + np.clip(way, 0, (end - begin)[:, None])[:, :, None] * rays[ray][:, None]
    farthest = np.sqrt(np.maximum((start**2).sum(axis=2), (stop**2).sum(axis=2)))
    nearest = np.sqrt((foot**2).sum(axis=2))
    near_for_sure = surely[:, None] & (farthest < delta - noise)
    near_perhaps = maybe[:, None] & (nearest < delta + noise)

    # a ray sees a target for sure where it certainly meets something, and whatever it meets first is near
    sure = np.ones((len(rays), len(targets)), dtype=bool)
    np.logical_and.at(sure, ray, near_for_sure)
    some = np.zeros(len(rays), dtype=bool)
    some[ray[certain]] = True
    return (sure & some[:, None]).any(axis=0), near_perhaps.any(axis=0)


def _beside_weaker(case: Case, model: LidarModel, origin: Float, rays: Float, begin: Float, end: Float) -> Boolean:
    """Whether hits may lie within the tolerance of a triangle that would return too weakly, and so not count."""
    triangles = case.site.triangles
    edges = np.roll(triangles, -1, axis=1) - triangles
    normals = np.cross(edges[:, 0], edges[:, 1])
    size = np.linalg.norm(normals, axis=1)
    weaker = np.zeros(len(rays), dtype=bool)
    points, reach = origin + ((begin + end) / 2)[:, None] * rays, (end - begin) / 2 + 1.05 * caster_tolerance(triangles)
    for corners, sides, normal, area, share in zip(
        triangles, edges, normals, size, case.site.reflectivity, strict=True
    ):
        if area == 0:
            continue
        unit = normal / area
        there = np.abs((points - corners[0]) @ unit) <= reach
        for corner, side in zip(corners, sides, strict=True):
            outward = np.cross(side, unit) / np.linalg.norm(side)
            there &= (points - corner) @ outward <= reach
        reflected = share * np.abs(rays @ unit) * (1 - 1e-9)
        weaker |= there & ~_is_strong(model, case.settings, end, reflected)
    return weaker


def _is_strong(model: LidarModel, settings: VisibilitySettings, distance: Float, reflected: Float) -> Boolean:
    """Whether hits count: by the intensity that is asked for, or by the probability of detection, written out."""
    law = model.law
    if isinstance(law, CarlaDropoff):
        return reflected * np.exp(-law.attenuation * distance) >= settings.min_intensity * (1 - 1e-12)
    with np.errstate(divide="ignore", invalid="ignore"):
        power = np.log(reflected) - 2 * law.extinction * distance - 2 * np.log(distance)
    return law.ceiling * ndtr((power - law.threshold) / law.spread) >= settings.detection * (1 - 1e-12)


def ndtr(z: Float) -> Float:
    """Return Φ(z), from the error function of the C library."""
    return np.array([0.5 * math.erfc(-one / math.sqrt(2)) for one in z])


def _hits(
    rays: Float, corners: Float, noise: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Boolean, Float, Float]:
    """Pairs of rays and triangles that may meet, whether they certainly do, and between which distances."""
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1) + noise
    ahead = rays @ centre.T
    gap = (centre**2).sum(axis=1) - ahead**2
    ray, triangle = np.nonzero((gap <= reach**2 + 1e-9 * (1 + (centre**2).sum(axis=1))) & (ahead >= -reach))
    direction, corner = rays[ray][:, None], corners[triangle]
    depth = (corner * direction).sum(axis=2)
    flat = corner - depth[:, :, None] * direction  # seen along the ray, which is the point 0
    following = np.roll(flat, -1, axis=1)
    edge = following - flat
    length = (edge**2).sum(axis=2)
    along = np.clip(-(flat * edge).sum(axis=2) / np.where(length > 0, length, 1), 0, 1)
    to_edge = np.linalg.norm(flat + along[:, :, None] * edge, axis=2).min(axis=1)
    side = (np.cross(flat, following) * direction).sum(axis=2)
    inside = (side > 0).all(axis=1) | (side < 0).all(axis=1)

    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    longest = ((np.roll(corner, -1, axis=1) - corner) ** 2).sum(axis=2).max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (normal * direction[:, 0]).sum(axis=1) / area
        distance = (corner[:, 0] * normal).sum(axis=1) / area / cosine
        # a long thin triangle's plane turns when its corners are rounded; no return lies beyond the triangle
        error = noise * np.maximum(longest / area, 1) / np.abs(cosine) + noise
    low, high = depth.min(axis=1) - noise, depth.max(axis=1) + noise
    distance = np.where(np.isfinite(distance), distance, 0.0)
    error = np.where(np.isfinite(error), error, np.inf)
    begin, end = np.clip(distance - error, low, high), np.clip(distance + error, low, high)
    possible = (inside | (to_edge <= noise)) & (end > -noise) & (area > 0)
    certain = inside & (to_edge > noise) & (begin > noise)
    return ray[possible], triangle[possible], certain[possible], np.maximum(begin, 0)[possible], end[possible]


# ---- the search ------------------------------------------------------------------------------------------------------


def differences(case: Case, engine: Engine, verdict: Verdict) -> Counter[str]:
    """Count the entries of a case's grid, and where it is not what the references say."""
    lazy = finish(compute_visibility(case.site, case.models, case.settings, engine, threads=1)).visible
    caster = make_ray_caster(case.site.triangles, engine)
    full, _ = full_scan(case.site, case.models, case.settings, caster)
    return Counter(
        {
            "entries": lazy.size,
            "seen": int(lazy.sum()),
            "undecided": int(verdict.undecided.sum()),
            "not the full scan's": int((lazy != full).sum()),
            "not float64's": int(((lazy != verdict.seen) & ~verdict.undecided).sum()),
        }
    )


FAULTS = ("not the full scan's", "not float64's")


def search(engines: Sequence[Engine], scenes: int, first_seed: int = 0) -> Counter[str]:
    """Try scenes one after the other, say which are at fault, and count what was found."""
    total: Counter[str] = Counter()
    for seed in range(first_seed, first_seed + scenes):
        case = draw_case(seed)
        verdict = assess(case)
        for engine in engines:
            found = differences(case, engine, verdict)
            total += found
            if any(found[fault] for fault in FAULTS):
                sys.stdout.write(f"scene {seed} ({case.kind}, {engine}): {dict(found)}\n")
        total["scenes"] += 1
    return total


def sentence(total: Counter[str]) -> str:
    named = ", ".join(f"{total[name]:,} {name}" for name in ("entries", "seen", "undecided", *FAULTS))
    return f"{total['scenes']:,} scenes: {named}"
