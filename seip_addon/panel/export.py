"""The section "Export": files of the placement and the report on them."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy

from ..core.base.progress import Progress
from ..core.output.pictures.labelled_view import save_labelled_view
from ..core.output.pictures.palette import unpacked_counts
from ..core.output.report.sections import write_report
from ..core.output.results.placement_record import parsed_record
from ..core.storage.files import check_folder
from ..scene.blend_file import save_blend, save_glb
from ..scene.pieces import tidy_pieces
from ..scene.read import attribution_of
from ..scene.render import render_elsewhere
from ..scene.result_folder import result_files, write_tables
from ..scene.write import coverage_of, show_seen_by, shown_legend
from . import scene_status
from .layout import draw_path, draw_reason, draw_run
from .properties import absolute, saved_path
from .scene_status import no_folder, not_evaluated
from .session import SceneState, session
from .survey import with_placement
from .work import ForPlacement, Job, LongWork, started


class SEIP_OT_export_result(ForPlacement, LongWork, bpy.types.Operator):
    """Write the report, tables, pictures and the scene with its sensors to the folder, replacing earlier ones"""

    bl_label = "Export"
    obstacles = (*ForPlacement.obstacles, no_folder, not_evaluated)
    stopped_message = "stopped; no report was written"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Save the scene as it is, find the placement again and write it, and report where the files are."""
        folder = saved_path(scene.seip.result.folder, "the result")
        check_folder(folder)
        scene, state = yield started(_exported(folder, scene))
        session.of(scene).state = state
        self.report({"INFO"}, f"written to {folder}")


def _exported(folder: Path, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
    """Write a result: the scene before the first report, which is the part that needs Blender's data."""
    result, name = scene.seip.result, scene.name
    render, wants_report = result.render, result.report
    finding = with_placement(scene)
    if coverage_of(scene) is not None:
        show_seen_by(scene, unpacked_counts(result.seen))  # it may show a comparison, or sensors on the move
    legend = shown_legend(scene)
    tidy_pieces(scene)
    with result_files(folder) as part:
        save_blend(part["placed.blend"])
        save_glb(part["scene.glb"], attribution_of(scene))
        yield Progress(0, 0, "reading the scene")
        state = yield from finding
        survey, solution = state.placed()
        record = parsed_record(state.record)
        record = replace(record, settings={**record.settings, "render": render})
        yield from write_tables(part, survey, solution, record)
        if render:
            site, deployment, created = survey.site, solution.deployment, record.times.created
            with TemporaryDirectory(prefix="seip-") as temporary:
                raw = Path(temporary) / "view.png"
                sight = yield from render_elsewhere(raw, part["placed.blend"], name, site, deployment)
                save_labelled_view(part["view.png"], raw, site, deployment, legend, sight, created=created)
    survey.grid.save(folder / "visibility.npz")
    if wants_report:
        yield from write_report(folder)
    return state


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the folder and the buttons."""
    scene = context.scene
    if draw_reason(layout, scene_status.no_placement(scene)):
        return
    draw_path(layout, scene.seip.result, "folder")
    layout.prop(scene.seip.result, "report")
    layout.prop(scene.seip.result, "render")
    draw_reason(layout, scene_status.no_folder(scene) or scene_status.not_evaluated(scene))
    draw_run(layout, "seip.export_result", icon="EXPORT")
    folder = absolute(scene.seip.result.folder)
    if folder.is_dir():
        layout.operator("wm.path_open", text="Open Folder", icon="FILE_FOLDER").filepath = str(folder)
