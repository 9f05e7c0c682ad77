"""Measure the visibility engine on a scene against full scans, side by side in one process.

python -m headless.benchmark scenes/junction.blend
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ParamSpec

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session

import bpy
import numpy as np

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.candidates import CandidateSettings
from seip_addon.core.errors import SeipError
from seip_addon.core.lidar import LidarModel, load_catalogue
from seip_addon.core.site import Site, make_site
from seip_addon.core.visibility.grid import VisibilitySettings
from seip_addon.core.visibility.observer import Observer, places
from seip_addon.core.visibility.ray_casting import Engine, RayCaster, make_ray_caster
from seip_addon.core.visibility.scanning import Place, seen_by_all_rays
from seip_addon.scene.read import read_scene

P = ParamSpec("P")

ENGINES: tuple[Engine, ...] = ("bvh", "embree")


@dataclass
class Cost:
    """What a way to compute visibility took, summed over places.

    Parameters
    ----------
    seconds : float
        Of processor time, all threads together.
    rays : int
    seen : int
        Pairs of pose and target.
    """

    seconds: float = 0.0
    rays: int = 0
    seen: int = 0


def visibility_costs(
    site: Site, models: dict[str, LidarModel], settings: VisibilitySettings, samples: int
) -> dict[str, Cost]:
    """Compute the same poses in four ways in turn: plain full scan and lazily, with each engine.

    Parameters
    ----------
    site : Site
    models : dict of str to LidarModel
    settings : VisibilitySettings
    samples : int
        How many places, evenly spread over the site.

    Returns
    -------
    dict of str to Cost
        By ``full bvh``, ``lazy bvh``, ``full embree`` and ``lazy embree``.

    Raises
    ------
    SeipError
        A lazy result is not that of its full scan.
    """
    every = places(site.candidates.xyz, site.candidates.yaw)
    sample = [every[number] for number in np.unique(np.linspace(0, len(every) - 1, samples).astype(int))]
    casters = {engine: make_ray_caster(site.triangles, engine) for engine in ENGINES}
    observers = {
        engine: Observer(site, models, settings.delta, settings.min_intensity, casters[engine]) for engine in ENGINES
    }
    costs = {f"{way} {engine}": Cost() for way in ("full", "lazy") for engine in ENGINES}
    for poses in sample:
        for engine in ENGINES:
            full = _timed(costs[f"full {engine}"], _full_scan, site, models, settings, casters[engine], poses)
            lazy = _timed(costs[f"lazy {engine}"], _lazily, observers[engine], poses)
            if (full != lazy).any():
                raise SeipError(f"pose {poses[0]}: the lazy {engine} grid is not the full scan's; this is a defect")
    return costs


def cast_rate(caster: RayCaster, origin: Float, rays: int = 20_000) -> float:
    """Return how many rays a second a caster casts, in one thread, in random directions below the horizon."""
    random = np.random.default_rng(0)
    directions = random.normal(size=(rays, 3)) * (1, 1, 0.1)
    directions[:, 2] = -np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    start = time.process_time()
    caster.cast(origin, directions, 100.0)
    return rays / (time.process_time() - start)


def main(argv: list[str]) -> None:
    """Print what each way costs and their ratios."""
    parser = argparse.ArgumentParser(
        prog="benchmark", description=__doc__.splitlines()[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("--places", type=int, default=12, help="how many places are sampled; a full scan takes seconds")
    options = parser.parse_args(argv)
    session.open_scene(options.scene)
    layout, settings = CandidateSettings(), VisibilitySettings()
    site = make_site(read_scene(bpy.context.scene).geometry, layout)
    models = load_catalogue()
    costs = visibility_costs(site, models, settings, options.places)
    poses = sum(len(place) for place in places(site.candidates.xyz, site.candidates.yaw))
    session.say(f"{site.name}: {len(site.targets):,} targets, {poses:,} poses; every lazy grid is its full scan's")
    session.say("                 s of CPU   rays cast  rays per seen target")
    for way, cost in costs.items():
        session.say(f"{way:<14}{cost.seconds:>11.3f}{cost.rays:>12,}{cost.rays / cost.seen:>12.1f}")
    plain = costs["full bvh"].seconds
    session.say(f"lazy bvh against full bvh:       {plain / costs['lazy bvh'].seconds:.0f}×")
    session.say(f"lazy embree against full bvh:    {plain / costs['lazy embree'].seconds:.0f}×")
    session.say(f"lazy embree against full embree: {costs['full embree'].seconds / costs['lazy embree'].seconds:.0f}×")
    for engine in ENGINES:
        rate = cast_rate(make_ray_caster(site.triangles, engine), site.candidates.xyz[0])
        lazy = costs[f"lazy {engine}"]
        session.say(
            f"limit, one {engine} cast per seen target at {rate / 1e6:.2f} million rays a second: "
            f"{lazy.seen / rate:.3f} s, the lazy run takes {lazy.seconds * rate / lazy.seen:.1f} times that"
        )


def _timed(cost: Cost, work: Callable[P, tuple[Boolean, int]], *args: P.args, **kwargs: P.kwargs) -> Boolean:
    start = time.process_time()
    seen, rays = work(*args, **kwargs)
    cost.seconds += time.process_time() - start
    cost.rays += rays
    cost.seen += int(seen.sum())
    return seen


def _full_scan(
    site: Site, models: dict[str, LidarModel], settings: VisibilitySettings, caster: RayCaster, poses: Integer
) -> tuple[Boolean, int]:
    used = [models[key] for key in site.candidates.sensor[poses].tolist()]
    origin, yaw = site.candidates.xyz[poses[0]], float(site.candidates.yaw[poses[0]])
    place = Place(caster, origin, yaw, used, settings.delta, settings.min_intensity)
    return seen_by_all_rays(place, site.targets.xyz)


def _lazily(observer: Observer, poses: Integer) -> tuple[Boolean, int]:
    rows = observer.see(poses)
    return np.unpackbits(rows.packed, axis=1, count=observer.targets).astype(bool), rows.rays


if __name__ == "__main__":
    session.run(main)
