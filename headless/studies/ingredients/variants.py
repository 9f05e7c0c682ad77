"""Ingredients of the training of a detector for unseen sites, each of which can be left out."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

from headless.detection.detection_area import DetectionArea
from headless.detection.recordings import SampledRun
from headless.studies.random_sites.varied_bodies import resized, with_sizes

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.geometry.height_raster import HeightRaster
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.world.traffic_simulation.demand import MODELS

SIZE_CHANGE = 0.15  # largest relative change of the dimensions of road users, in a training and in a test
FEW_SITES = 2  # training sites of the variant without many sites


@dataclass(frozen=True)
class ScanIngredients:
    """Ingredients that determine the training scans.

    Parameters
    ----------
    varied_bodies : bool
        Whether road users have the sizes and shapes of their runs; otherwise each has those of the nearest model.
    resized : float
        Largest relative change of each dimension of each road user, beyond the spread of real ones.
    random_placements : bool
        Whether each run is scanned by a random placement; otherwise by the site's placement of largest coverage.
    many_sites : bool
        Whether all sites are used; otherwise the first `FEW_SITES`, with more random placements at each so that the
        number of scans stays similar.
    """

    varied_bodies: bool = True
    resized: float = 0.0
    random_placements: bool = True
    many_sites: bool = True


@dataclass(frozen=True)
class Ingredients:
    """Ingredients of a training that help a detector at unseen sites.

    Parameters
    ----------
    foreground : bool
        Whether the background is removed from clouds.
    levelled : bool
        Whether heights are above the road under each point; otherwise above the mean height of the site's roads.
    scans : ScanIngredients
    """

    foreground: bool = True
    levelled: bool = True
    scans: ScanIngredients = ScanIngredients()

    def area(self, area: DetectionArea) -> DetectionArea:
        """Return the detection area of a site with these ingredients."""
        road = area.road if self.levelled else _mean_level(area.road)
        kind = DetectionArea if self.foreground else _AllReturns
        return kind(area.grid, road, area.site)


ALL = "all"
VARIANTS: Mapping[str, Ingredients] = {
    ALL: Ingredients(),
    "background left in": Ingredients(foreground=False),
    "heights above one level": Ingredients(levelled=False),
    "bodies of few models": Ingredients(scans=ScanIngredients(varied_bodies=False)),
    "one placement at each site": Ingredients(scans=ScanIngredients(random_placements=False)),
    f"{FEW_SITES} sites": Ingredients(scans=ScanIngredients(many_sites=False)),
    f"bodies changed by ±{SIZE_CHANGE:.0%} as well": Ingredients(scans=ScanIngredients(resized=SIZE_CHANGE)),
}
"""Variants of the training by name: with all ingredients, without each, and with one that the default lacks."""


class _AllReturns(DetectionArea):
    """An area whose clouds keep their background."""

    def cloud(self, frame: Frame) -> NDArray[np.float32]:
        """Return the returns over the grid."""
        return super().cloud(replace(frame, foreground=np.ones(len(frame), dtype=np.bool_)))


def _mean_level(road: HeightRaster) -> HeightRaster:
    return HeightRaster(road.low, road.step, np.full_like(road.heights, road.heights.mean()))


def with_bodies(run: SampledRun, ingredients: ScanIngredients, seed: int) -> Generator[Progress, None, SampledRun]:
    """Return a run with the bodies of its road users changed according to the ingredients."""
    if not ingredients.varied_bodies:
        run = replace(run, trajectories=(yield from _with_bodies_of_models(run.trajectories)))
    if ingredients.resized:
        run = replace(run, trajectories=(yield from resized(run.trajectories, ingredients.resized, seed)))
    return run


def _with_bodies_of_models(trajectories: Trajectories) -> Generator[Progress, None, Trajectories]:
    """Give each road user the size of the nearest model of traffic simulations, and no shape of its own."""
    users = tuple(replace(user, shape=RoadUser.shape) for user in trajectories.users)
    sizes = np.array([_nearest_model(user) for user in users])
    return (yield from with_sizes(replace(trajectories, users=users), sizes))


def _nearest_model(user: RoadUser) -> tuple[float, float, float]:
    own = np.array((user.length, user.width, user.height))
    sizes = [(model.length, model.width, model.height) for model in MODELS[user.category].values()]
    return min(sizes, key=lambda size: float((np.log(own / size) ** 2).sum()))
