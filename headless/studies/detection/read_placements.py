"""Placements written by `seip place` or the panel, as sensor configurations for evaluation."""

from collections.abc import Generator, Sequence
from pathlib import Path

from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.placement_file import load_placement
from seip_addon.core.output.results.placement_record import PlacementRecord
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.site.site import Site
from seip_addon.core.workflows.moved_sensors import evaluate_moved_sensors
from seip_addon.core.workflows.survey import Survey

FILE = "placement.json"
MAX_ORIGIN_DIFFERENCE = 1e-3  # metres between the origins of one scene


def records_in(folders: Sequence[Path]) -> dict[str, PlacementRecord]:
    """Return the records of placements by the names of their folders.

    Raises
    ------
    SeipError
        A folder has no placement, a placement without sensors, or the same name as another folder.
    """
    records: dict[str, PlacementRecord] = {}
    for folder in folders:
        name = folder.resolve().name
        if name in records:
            raise SeipError(f"two placements are called {name!r}, after their folders: rename one of the folders")
        record = load_placement(folder / FILE)
        if not record.sensors:
            raise SeipError(f"the placement in {folder} has no sensors: optimise a placement with `seip place` first")
        records[name] = record
    return records


def read_placements(
    survey: Survey, records: dict[str, PlacementRecord]
) -> Generator[Progress, None, tuple[SensorConfiguration, ...]]:
    """Return placements of the surveyed scene, with the visibility of its targets.

    The sensors may be of any types and mounted anywhere. The survey's weather applies to them.

    Raises
    ------
    SeipError
        A placement is of another scene, or its sensors are of an unknown type.
    """
    found = []
    for done, (name, record) in enumerate(records.items()):
        progress = Progress(done, len(records), f"read {name}")
        yield progress
        _require_scene(survey.site, name, record)
        keys = sorted({sensor.sensor for sensor in record.sensors})
        weather = survey.settings.weather
        known = find_models(load_catalogue(survey.settings.catalogue), keys)
        mounted = [one.mounted(weather.through(known[one.sensor])) for one in record.sensors]
        places = {one.id: one.position for one in record.sensors}
        solution = yield from within(progress, evaluate_moved_sensors(survey, Objective(), mounted, places))
        gap = np.inf if record.objective.gap is None else record.objective.gap
        found.append(
            SensorConfiguration(
                f"{len(mounted)} × {name}",
                solution.deployment,
                name,
                len(mounted),
                record.objective.status,
                gap,
                read=True,
            )
        )
    yield Progress(len(records), len(records), "placements read")
    return tuple(found)


def _require_scene(site: Site, name: str, record: PlacementRecord) -> None:
    there = record.site
    if there.name != site.name or not np.allclose(there.origin_m, site.origin, rtol=0, atol=MAX_ORIGIN_DIFFERENCE):
        raise SeipError(
            f"the placement {name!r} is of the scene {there.name!r} at {_written(there.origin_m)}, not of "
            f"{site.name!r} at {_written(site.origin)}: evaluate it on its own scene"
        )


def _written(origin: Sequence[float] | np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return ", ".join(f"{value:.3f}" for value in origin)
