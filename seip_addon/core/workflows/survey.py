"""Surveys: site layout and visibility grid."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..base.arrays import Integer
from ..base.progress import Progress
from ..choosing.placement.deployment import Deployment, deploy
from ..sensing.lidar.carla_dropoff import CarlaDropoff
from ..sensing.lidar.model import LidarModel, fields_of_view
from ..sensing.visibility.grid import VisibilityGrid, stored_visibility, visibility_key
from ..sensing.visibility.ray_casting import engine_name
from ..sensing.visibility.ring_resolution import resolution_warnings
from ..sensing.visibility.road_range import range_warnings, road_reflectivity
from ..sensing.visibility.settings import VisibilitySettings
from ..sensing.visibility.surroundings import Surroundings
from ..sensing.weather import Weather
from ..site.candidates import assumed_pole_warnings
from ..site.far_objects import without_far_objects
from ..site.obstruction import bareness_warnings
from ..site.scene_geometry import SceneGeometry
from ..site.site import Site, make_site
from .survey_settings import SurveySettings


@dataclass(frozen=True, eq=False)
class Layout:
    """A scene with targets and candidates for a survey.

    Parameters
    ----------
    geometry : SceneGeometry
        Geometry of the scene.
    models : dict of str to LidarModel
        Sensor types to choose from, by catalogue key.
    warnings : tuple of str
        Warnings about the accuracy of the figures.
    """

    geometry: SceneGeometry
    site: Site
    models: dict[str, LidarModel]
    settings: SurveySettings
    warnings: tuple[str, ...]


def lay_out(geometry: SceneGeometry, settings: SurveySettings, warnings: Sequence[str] = ()) -> Layout:
    """Place targets and candidates in a scene.

    Parameters
    ----------
    warnings : sequence of str
        Warnings from reading the scene.

    Raises
    ------
    SeipError
        Same as for `SurveySettings.models` and `make_site`.

    Examples
    --------
    A street of 40 by 10 m with a lamp, and nothing that could hide a part of it:

    >>> import shapely
    >>> from seip_addon.core.site.candidates import CandidateSettings
    >>> from seip_addon.core.site.scene_geometry import Mesh, Pole
    >>> corners = np.array([[-20.0, -5.0, 0.0], [20.0, -5.0, 0.0], [20.0, 5.0, 0.0], [-20.0, 5.0, 0.0]])
    >>> street = Mesh("street", corners[[[0, 1, 2], [0, 2, 3]]])
    >>> lamp = Pole("lamp", np.array([0.0, 6.0, 0.0]))
    >>> region = shapely.box(-20, -5, 20, 5)
    >>> geometry = SceneGeometry("Mill Lane", np.zeros(3), (street,), (), (), region, poles=(lamp,))
    >>> layout = lay_out(geometry, SurveySettings(CandidateSettings(sensors=("type3",), heights=(5.0, 8.0))))
    >>> len(layout.site.targets), len(layout.site.candidates), list(layout.models)
    (400, 2, ['type3'])
    >>> layout.warnings[0].partition(":")[0]
    'nothing in this scene can hide anything'
    """
    models = settings.models()
    reach = settings.reach(models)
    geometry = settings.weather.over(geometry)
    site = make_site(geometry, settings.candidates, settings.grid_spacing, reach, fields_of_view(models))
    if settings.installed_cost is not None:
        candidates = settings.installed_cost.over(site.candidates, settings.candidates.bracket)
        site = replace(site, candidates=candidates)
    near, far = without_far_objects(geometry, geometry.region, reach)
    limits = (
        *far,
        *bareness_warnings(near, np.concatenate([site.candidates.xyz[:, :2], site.targets.xyz[:, :2]])),
        *assumed_pole_warnings(geometry, site.candidates),
        *resolution_warnings(site, models, settings.visibility),
        *carla_warnings(models, settings),
        *range_warnings(site, models, road_reflectivity(geometry.roads), settings.visibility),
    )
    return Layout(geometry, site, models, settings, (*warnings, *limits))


def carla_warnings(models: Mapping[str, LidarModel], settings: SurveySettings) -> tuple[str, ...]:
    """Return a warning about sensor types that no weather affects, and on comparing them with types that it affects."""
    types = [key for key, model in models.items() if isinstance(model.law, CarlaDropoff)]
    others = [key for key in models if key not in types]
    changed = settings.weather != Weather() or settings.visibility.detection != VisibilitySettings().detection
    if not types or not (others or changed):
        return ()
    named = f"{', '.join(types)}: every return in range counts (CARLA's model), whatever the weather and the surface"
    return (f"{named}; {', '.join(others)} must detect it: do not compare the two" if others else named,)


@dataclass(frozen=True, eq=False)
class Survey(Layout):
    """A layout with its visibility grid.

    Parameters
    ----------
    returns_path : path, optional
        File of the returns grid, read and written when a placement is chosen for returns; None to keep it in memory
        only.
    """

    grid: VisibilityGrid
    returns_path: Path | None = None

    def deploy(self, chosen: Integer) -> Deployment:
        """Return the sensors at candidate poses (k,) with their coverage."""
        return deploy(self.site, self.models, self.grid.rows(chosen), chosen)


def grid_key(layout: Layout) -> str:
    """Return the key of the visibility grid of a survey, by which it is stored."""
    settings = layout.settings
    return visibility_key(layout.site, layout.models, settings.visibility, engine_name(settings.engine))


def see(layout: Layout, path: Path, threads: int | None = None) -> Generator[Progress, None, Survey]:
    """Compute the visibility grid of a layout, or read it from a file if it was computed from the same inputs.

    Parameters
    ----------
    path : path
        File of the grid, read and written.
    threads : int, optional
        Maximum number of threads.
    """
    settings = layout.settings
    grid = yield from stored_visibility(path, layout.site, layout.models, settings.visibility, settings.engine, threads)
    return with_grid(layout, grid, path)


def with_grid(layout: Layout, grid: VisibilityGrid, path: Path | None = None) -> Survey:
    """Return the survey of a layout with a given visibility grid; ``path`` is the file that it is stored in, if any."""
    returns_path = None if path is None else path.with_suffix(".returns.npz")
    return Survey(**{**vars(layout), "grid": grid, "returns_path": returns_path})


def surroundings(layout: Layout) -> Surroundings:
    """Return the inputs of visibility from arbitrary poses in a survey."""
    settings = layout.settings
    return Surroundings(layout.site, layout.models, settings.visibility, layout.geometry.occluders, settings.engine)
