"""A visibility grid on disk that is computed once and used again while its inputs stay the same."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from pathlib import Path

from .errors import SeipError
from .lidar import LidarModel
from .progress import Progress
from .ray_casting import Engine, make_ray_caster
from .site import Site
from .visibility import VisibilityGrid, VisibilitySettings, compute_visibility, visibility_key


def stored_visibility(
    path: Path,
    site: Site,
    models: Mapping[str, LidarModel],
    settings: VisibilitySettings,
    engine: Engine = "auto",
) -> Generator[Progress, None, VisibilityGrid]:
    """Return the grid of a file where it follows from the same inputs; else compute it and write the file.

    Parameters
    ----------
    path : path
        The grid's file, read and written.
    site : Site
    models : mapping of str to LidarModel
    settings : VisibilitySettings
    engine : {"auto", "bvh", "embree"}
        What casts the rays.

    Returns
    -------
    VisibilityGrid
    """
    caster = make_ray_caster(site.triangles, engine)
    key = visibility_key(site, models, settings, caster)
    stored = _load(path)
    if stored is not None and stored.key == key:
        yield Progress(len(site.candidates), len(site.candidates), "visibility, from an earlier run")
        return stored
    grid = yield from compute_visibility(site, models, settings, caster)
    grid.save(path)
    return grid


def _load(path: Path) -> VisibilityGrid | None:
    """Return the grid of a file, or None where there is none that can be used again."""
    try:
        return VisibilityGrid.load(path)
    except SeipError:
        return None
