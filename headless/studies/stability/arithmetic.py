"""Both ray casters against float64 on numerically hard scenes.

Each scene is checked in two ways. Hits: the number that differ from float64's, and
whether rounding explains all of them. Visibility V: whether any entry differs although
its margin to δ, and to everything in front of it, is larger than the rounding.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from shapely import box

from seip_addon.core.arrays import Boolean, Float
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.float32_precision import FLOAT32_STEP, MAX_STEP
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import MAX_DELTA, Engine, VisibilitySettings
from seip_addon.core.site.site import Candidates, Site, Targets

from .float64_rays import FirstHits, first_hits
from .hard_scenes import HardScene, far_away, hard_scenes, ordinary_scene, stored_far_away, with_stray
from .rows import Row
from .shares import Share

MAX_ROUNDINGS = 64
"""Tolerance of a hit, in steps of float32 at the scene's extent; visibility uses the same."""

DISTANCES = tuple(10.0 ** (half / 2) for half in range(4, 15))
"""Distances of a moved ordinary street, or of a stray mesh, from the origin, metres."""

RAY_LENGTH = 1e9  # metres

DELTA = 0.5
TARGETS = 300
SENSOR = LidarModel(
    key="probe",
    name="probe",
    manufacturer="none",
    source="none",
    elevations=np.radians(np.linspace(-70, 0, 24)),
    min_range=0.001,
    max_range=9000.0,
    points_per_second=24 * 10 * 150.0,
    rotation_rate=10.0,
    price_range=(1.0, 1.0),
)
"""Sensor of the test scenes, with few rays, so that all of them can be cast in float64."""


@dataclass(frozen=True)
class HitCheck:
    """Hits of a ray caster compared with float64.

    Parameters
    ----------
    distance : float, metres
        Distance of the street, or of the stray mesh, from the origin; 0 if not varied.
    extent : float, metres
        Extent of scene and rays.
    flipped : Share
        Rays that hit a different surface, or hit instead of missing, or miss instead of hitting.
    unexplained : Share
        Rays whose hit is not explained by rounding.
    off : float, metres
        Largest error of the other hits, perpendicular to their surfaces.
    off_along : float, metres
        Largest error of the other hits along the rays.
    """

    scene: str
    engine: str
    distance: float
    extent: float
    flipped: Share
    unexplained: Share
    off: float
    off_along: float


@dataclass(frozen=True)
class GridCheck:
    """A visibility grid compared with float64.

    Parameters
    ----------
    flipped : Share
        Entries that differ.
    in_band : Share
        Entries that may have either value by rounding.
    outside : Share
        Entries that differ without an explanation by rounding.
    """

    scene: str
    engine: str
    flipped: Share
    in_band: Share
    outside: Share


@dataclass(frozen=True)
class ArithmeticStudy:
    """Ray casters compared with float64.

    Parameters
    ----------
    hits : tuple of HitCheck
        Checks of each scene and engine.
    moved, stored, stray : tuple of HitCheck
        Checks by distance of an ordinary street that is moved away from the origin in float64; that is stored there
        in float32, as Blender does; and that has a stray mesh far away.
    """

    hits: tuple[HitCheck, ...]
    moved: tuple[HitCheck, ...]
    stored: tuple[HitCheck, ...]
    stray: tuple[HitCheck, ...]
    grids: tuple[GridCheck, ...]


def engines_here() -> tuple[Engine, ...]:
    """Return the ray casters that are installed."""
    known: tuple[Engine, ...] = ("bvh", "embree")
    found = []
    for engine in known:
        try:
            make_ray_caster(np.zeros((0, 3, 3)), engine)
        except SeipError:  # it is not installed
            continue
        found.append(engine)
    return tuple(found)


def arithmetic_study(
    rays: int = 20_000, seed: int = 0, engines: Sequence[Engine] | None = None
) -> Generator[Progress, None, ArithmeticStudy]:
    """Compare ray casters with float64 on numerically hard scenes.

    Parameters
    ----------
    rays : int
        Number of rays for each scene.
    engines : sequence of str, optional
        Ray casters; all that are installed if not given.
    """
    random = np.random.default_rng(seed)
    engines = engines_here() if engines is None else engines
    scenes = hard_scenes(rays, random)
    street = ordinary_scene(rays, random)
    total = len(scenes) + 1 + len(DISTANCES)
    hits, grids = [], []
    for number, scene in enumerate(scenes):
        yield Progress(number, total, f"float64 rays: {scene.name}")
        truth = _truth(scene)
        hits += [check_hits(scene, engine, truth) for engine in engines]
        grids += [check_grid(scene, engine) for engine in engines]
    yield Progress(len(scenes), total, "float64 rays: far away")
    here = _truth(street)
    moved, stored, stray = [], [], []
    for number, distance in enumerate(DISTANCES):
        yield Progress(len(scenes) + 1 + number, total, f"float64 rays: {distance:,.0f} m away")
        with_one = with_stray(street, distance)
        truth = _truth(with_one)
        for engine in engines:
            moved.append(check_hits(far_away(street, distance), engine, here, distance))
            stored.append(check_hits(stored_far_away(street, distance), engine, here, distance, kept_at=distance))
            stray.append(check_hits(with_one, engine, truth, distance))
    return ArithmeticStudy(tuple(hits), tuple(moved), tuple(stored), tuple(stray), tuple(grids))


def check_hits(
    scene: HardScene, engine: Engine, truth: FirstHits, distance: float = 0.0, *, kept_at: float = 0.0
) -> HitCheck:
    """Compare hits with float64; `kept_at` is the distance from the origin at which the scene was stored in float32."""
    found, _ = make_ray_caster(scene.triangles, engine).cast(scene.origin, scene.directions, RAY_LENGTH)
    missed = np.isfinite(found) != np.isfinite(truth.distance)
    both = np.isfinite(found) & np.isfinite(truth.distance)
    along = np.zeros(len(found))
    along[both] = np.abs(found[both] - truth.distance[both])
    across = along * truth.slope
    flipped = missed | (across > max(tolerance_of(scene), MAX_ROUNDINGS * FLOAT32_STEP * kept_at))
    return HitCheck(
        scene=scene.name,
        engine=engine,
        distance=distance,
        extent=extent_of(scene),
        flipped=Share(int(flipped.sum()), len(found)),
        unexplained=Share(int((~truth.allow(found)).sum()), len(found)),
        off=float(across[~flipped].max(initial=0.0)),
        off_along=float(along[~flipped].max(initial=0.0)),
    )


def check_grid(scene: HardScene, engine: Engine) -> GridCheck:
    """Compare the visibility of targets on a scene with float64, and with the entries that rounding may change."""
    site = _site(scene)
    delta = min(DELTA * extent_of(scene) / 20.0, MAX_DELTA)
    settings = VisibilitySettings(delta)
    seen = finish(compute_visibility(site, {SENSOR.key: SENSOR}, settings, engine)).visible[0]
    exact, surely, maybe = _seen_in_float64(scene, site.targets.xyz, delta)
    outside = (surely & ~seen) | (seen & ~maybe)
    return GridCheck(
        scene=scene.name,
        engine=engine,
        flipped=Share(int((seen != exact).sum()), len(seen)),
        in_band=Share(int((maybe & ~surely).sum()), len(seen)),
        outside=Share(int(outside.sum()), len(seen)),
    )


def extent_of(scene: HardScene) -> float:
    """Return the longest side of the box about a scene and the start of its rays, in metres."""
    points = np.concatenate([scene.triangles.reshape(-1, 3), scene.origin[None]])
    return float(np.ptp(points, axis=0).max())


def tolerance_of(scene: HardScene) -> float:
    """Return the largest error of a hit that rounding explains, in metres."""
    return MAX_ROUNDINGS * FLOAT32_STEP * extent_of(scene)


def _truth(scene: HardScene) -> FirstHits:
    return first_hits(scene.origin, scene.directions, scene.triangles, tolerance_of(scene))


def _seen_in_float64(scene: HardScene, targets: Float, delta: float) -> tuple[Boolean, Boolean, Boolean]:
    """Return whether targets are visible, surely visible, and possibly visible, (t,) bool each."""
    directions = BeamPattern(SENSOR).directions(np.arange(SENSOR.channels * SENSOR.azimuth_count))
    tolerance = tolerance_of(scene)
    hits = first_hits(scene.origin, directions, scene.triangles, tolerance)
    way = targets - scene.origin
    exact, surely, maybe = (np.zeros(len(targets), dtype=bool) for _ in range(3))
    for number, target in enumerate(way):
        along = directions @ target
        aside = np.sqrt(np.maximum(target @ target - along**2, 0.0))

        def gap(distance: Float, along: Float = along, aside: Float = aside) -> Float:
            return np.hypot(aside, np.where(np.isfinite(distance), distance, RAY_LENGTH) - along)

        exact[number] = _within(hits.distance, gap(hits.distance) < delta)
        ends = np.maximum(gap(hits.nearest), gap(hits.farthest))
        surely[number] = _within(hits.farthest, ends < delta - tolerance)
        closest = np.clip(along, hits.nearest, hits.farthest)
        maybe[number] = bool((np.isfinite(hits.nearest) & (gap(closest) < delta + tolerance)).any())
    return exact, surely, maybe


def _within(distance: Float, near: Boolean) -> bool:
    """Return whether some near ray ends within the sensor's range."""
    return bool((near & (distance >= SENSOR.min_range) & (distance <= SENSOR.max_range)).any())


def _site(scene: HardScene) -> Site:
    """Return a scene as a site: targets on its surfaces, and one pose at the origin of its rays."""
    random = np.random.default_rng(len(scene.triangles))
    which = random.integers(0, len(scene.triangles), TARGETS)
    share = random.dirichlet((1.0, 1.0, 1.0), TARGETS)
    targets = (scene.triangles[which] * share[:, :, None]).sum(axis=1)
    pose = scene.origin[None]
    return Site(
        name=scene.name,
        origin=np.zeros(3),
        region=box(*scene.triangles[:, :, :2].min(axis=(0, 1)), *scene.triangles[:, :, :2].max(axis=(0, 1))),
        targets=Targets(targets, np.ones(TARGETS), np.zeros(TARGETS, dtype=bool), 1.0),
        candidates=Candidates(
            position=pose,
            position_name=np.array(["probe"]),
            on_pole=np.zeros(1, dtype=bool),
            pole_source=np.full(1, ""),
            position_of=np.zeros(1, dtype=np.int64),
            sensor=np.array([SENSOR.key]),
            height=pose[:, 2],
            xyz=pose,
            yaw=np.zeros(1),
            tilt=np.zeros(1),
            mandatory=np.zeros((0, 1), dtype=bool),
            mandatory_name=np.zeros(0, dtype=np.str_),
            dropped={},
        ),
        triangles=scene.triangles,
        reflectivity=np.ones(len(scene.triangles)),
    )


def border(checks: Sequence[HitCheck], off: float) -> float:
    """Return the first distance at which the error of hits exceeds ``off`` metres, or infinity."""
    return min((c.distance for c in checks if c.off > off), default=math.inf)


def arithmetic_rows(study: ArithmeticStudy) -> list[Row]:
    """Return the rows on the limits of float32."""
    how = "{:,} rays for each scene, both ray casters compared with float64"
    trials = max(check.flipped.trials for check in study.hits)
    rows = []
    for engine in dict.fromkeys(check.engine for check in study.hits):
        own = [check for check in study.hits if check.engine == engine]
        flips = {check.scene: check.flipped for check in own if check.flipped.count}
        flipped = "; ".join(f"{scene}: {share.per_million}" for scene, share in flips.items()) or "no flipped hit"
        grids = [check for check in study.grids if check.engine == engine]
        outside, entries = sum(g.outside.count for g in grids), sum(g.outside.trials for g in grids)
        rows.append(
            Row(
                method=f"ray caster {engine}",
                regime="edges, vertices, grazing, slivers, duplicate, coplanar, open, inside out, mirrored, scaled",
                begins=f"{flipped}; {outside} of {entries:,} entries of V outside the noise band",
                how=how.format(trials),
                answer="rays hit both sides of surfaces; Embree's distances on slivers are recomputed in float64",
            )
        )
    for name, checks, answer in (
        ("far origin, computed", study.moved, "moves the origin to the scene's middle in float64 before casting"),
        ("far origin, stored by Blender", study.stored, "warns if the scene is that far from the origin"),
        ("stray mesh", study.stray, "leaves out what no sensor reaches, and names larger meshes in a warning"),
    ):
        first, second = border(checks, MAX_STEP), border(checks, 10 * MAX_STEP)
        rows.append(
            Row(
                method="ray casters",
                regime=name,
                begins=f"errors of hits over 1 mm {_from(first)}, over 1 cm {_from(second)}",
                how=how.format(trials) + ", at powers of ten",
                answer=answer,
            )
        )
    return rows


def _from(distance: float) -> str:
    return f"from {distance:,.0f} m on" if math.isfinite(distance) else f"nowhere up to {DISTANCES[-1]:,.0f} m"
