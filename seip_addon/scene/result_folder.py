"""The folder of results: tables, pictures, and the scene with its sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import bpy

from ..core.arrays import Boolean
from ..core.goal import Plan
from ..core.lidar import LidarModel
from ..core.pictures.plan_view import save_plan_view
from ..core.results.candidate_table import save_candidate_table
from ..core.results.carla import save_carla_spawns
from ..core.results.placement_record import Record, save_placement_record
from ..core.scene_geometry import SceneGeometry
from ..core.site import Site
from .blend_file import save_blend
from .render import save_rendered_view
from .write import write_result

FILES = ("placement.json", "candidates.csv", "carla_spawn.json", "plan.png", "view.png", "placed.blend")


def write_result_folder(  # noqa: PLR0913  # everything that a result is made of
    folder: Path,
    scene: bpy.types.Scene,
    geometry: SceneGeometry,
    site: Site,
    plan: Plan,
    record: Record,
    *,
    visible: Boolean,
    models: Mapping[str, LidarModel],
    render: bool = True,
) -> None:
    """Write a plan into the scene and all its files into a folder, in place of earlier ones.

    ``placement.json`` comes last: where it stands, everything else does.

    Parameters
    ----------
    folder : path
    scene : bpy.types.Scene
        Receives the sensors and the coverage.
    geometry : SceneGeometry
        What was read from the scene.
    site : Site
    plan : Plan
    record : dict
        What ``placement.json`` will hold.
    visible : (c, t) bool
        The visibility grid.
    models : mapping of str to LidarModel
    render : bool
        Whether to render ``view.png``, which takes the longest.
    """
    for name in FILES:
        (folder / name).unlink(missing_ok=True)
    deployment = plan.deployment
    save_candidate_table(folder / "candidates.csv", site, models, visible, deployment)
    save_carla_spawns(folder / "carla_spawn.json", deployment, site.origin)
    save_plan_view(folder / "plan.png", geometry, site, deployment, _notes(plan, record["warnings"], models))
    write_result(scene, site, deployment)
    save_blend(folder / "placed.blend")
    if render:
        save_rendered_view(folder / "view.png", scene, site, deployment)
    save_placement_record(folder / "placement.json", record)


def _notes(plan: Plan, warnings: Sequence[str], models: Mapping[str, LidarModel]) -> list[str]:
    """Return what the plan's reader should know: its certificate, and warnings but those of types not chosen."""
    used = {sensor.model.key for sensor in plan.deployment.sensors}
    others = set(models) - used
    return [plan.certificate, *(warning for warning in warnings if warning.partition(":")[0] not in others)]
