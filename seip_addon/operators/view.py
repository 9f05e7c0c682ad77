"""Operators on overlays: coverage, sight lines, legend, pictures."""

from __future__ import annotations

from itertools import chain, count
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.base.errors import SeipError
from ..core.sensing.visibility.sight_lines import pose_at, sight_lines
from ..properties.conversion import saved_path
from ..scene import contract
from ..scene.coverage_colours import colour_coverage
from ..scene.sensors import pose_of
from ..scene.write import coverage_of
from ..state.session import SceneState, session
from ..viewport import coverage, last_scan, overlays
from ..viewport.picture import view_pixels
from ..viewport.sight_lines import NAME as SIGHT
from ..viewport.sight_lines import sight_overlay
from . import scene_survey
from .base import Job, LongWork, Outcome, ShortWork
from .results import ForPlacement, active_sensor, not_evaluated

ASPECTS = (
    ("returns", "Returns", "Expected returns from a pedestrian, if sensors were placed for returns"),
    ("seen", "Seen", "Road surface that some sensor measures"),
    ("times", "Sensors", "Number of sensors that measure the road surface"),
    ("weights", "Weights", "Weight of each part of the road, if regions are weighted"),
)
"""Meanings of the road's colours, with their names and descriptions."""
NO_COVERAGE = "There is no coverage to show: place sensors first."


def why_no_coverage(scene: bpy.types.Scene) -> str:
    """Return why coverage cannot be coloured, or ""."""
    return NO_COVERAGE if coverage_of(scene) is None else ""


class SEIP_OT_colour_coverage(ShortWork, bpy.types.Operator):
    """Colour the coverage on the road, with a legend; a Solid view is set to show the colours"""

    bl_options = {"REGISTER", "UNDO"}

    aspect: bpy.props.EnumProperty(
        name="Show",
        description="Meaning of the road's colours",
        items=ASPECTS,
        default="times",
    )

    obstacles = (why_no_coverage,)

    def act(self, context: bpy.types.Context) -> None:
        """Colour it."""
        colour_coverage(context.scene, self.aspect)
        context.scene.seip.view.legend = True
        view = context.space_data
        if isinstance(view, bpy.types.SpaceView3D) and not coverage.shows_coverage(view):
            coverage.set_shading(view)


class SEIP_OT_show_sight_lines(ForPlacement, LongWork, bpy.types.Operator):
    """Draw lines from the sensor that is active in the list to the targets that it sees, and squares on those in its range that it does not see"""  # noqa: E501  # a tooltip is one line

    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and draw them."""
        scene, state = yield scene_survey.with_placement(scene)
        session.of(scene).state = state
        obj, label = active_sensor(scene), scene.seip.result.active_label()
        survey, _ = state.placed()
        key = str(obj.get(contract.SENSOR))
        pose = pose_at(survey.site.candidates, key, *pose_of(obj))
        if pose is None:
            raise SeipError(f"{label} is not at a candidate pose: move it back, or place again")
        settings = survey.settings
        row = survey.grid.sees(pose)
        sight = sight_lines(survey.site, pose, survey.models[key], row, settings.visibility.delta, settings.engine)
        overlays.show(scene, SIGHT, sight_overlay(sight, label))


class SEIP_OT_hide_overlay(ShortWork, bpy.types.Operator):
    """Hide these points or lines"""

    bl_label = "Hide"

    name: bpy.props.StringProperty(name="Name", description="Name of the overlay")

    def act(self, context: bpy.types.Context) -> None:
        """Hide it; a point cloud is forgotten, as it would be shown again in other colours."""
        if self.name == last_scan.NAME:
            last_scan.hide_cloud(context.scene)
        overlays.hide(context.scene, self.name)


class SEIP_OT_save_picture(ForPlacement, LongWork, bpy.types.Operator):
    """Write a view of the placement with its legend, and the plan beside it, as one PNG"""

    bl_options = {"REGISTER"}  # nothing in the file changes

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """Remember which viewport was meant."""
        self._area = context.area
        return super().invoke(context, event)

    obstacles = (*ForPlacement.obstacles, not_evaluated)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and take the picture of a viewport."""
        path = _free(_named(scene.seip.view.picture))
        scene, state = yield scene_survey.with_placement(scene)
        session.of(scene).state = state
        area = getattr(self, "_area", None) or bpy.context.area
        if bpy.app.background or area not in overlays.viewports(bpy.context.window_manager.windows):
            raise SeipError(
                "there is no viewport here to take a picture of: press this in the sidebar of one, or export the files "
                "with the rendered view"
            )
        save_viewport_sheet(path, state, view_pixels(scene, area))
        self.report({"INFO"}, f"written {path}")


def save_viewport_sheet(path: Path, state: SceneState, pixels: NDArray[np.uint8]) -> None:
    """Write a picture of a viewport, and the plan beside it."""
    from PIL import Image  # noqa: PLC0415  # pictures take half a second to come, which nobody waits for at start

    from ..core.output.pictures.labelled_view import save_sheet  # noqa: PLC0415  # as above
    from ..core.output.pictures.plan_view import save_plan_view  # noqa: PLC0415  # as above

    survey, solution = state.placed()
    view = Image.fromarray(pixels)
    with TemporaryDirectory(prefix="seip-") as folder:
        drawn = Path(folder) / "plan.png"
        save_plan_view(drawn, survey.geometry, survey.site, solution.deployment, solution.caption)
        with Image.open(drawn) as picture:
            save_sheet(path, view, picture)


def _named(text: str) -> Path:
    path = saved_path(text, "the picture")
    if not path.name or path.is_dir():
        raise SeipError("name a file for the picture, not a folder")
    return path.with_suffix(".png")


def _free(path: Path) -> Path:
    """Return the name, with the first number that is free where there is a picture of that name."""
    numbered = (path.with_stem(f"{path.stem}-{number}") for number in count(2))
    return next(name for name in chain([path], numbered) if not name.exists())
