"""The check of a site: its contents, and problems that prevent a placement or make it wrong."""

from __future__ import annotations

from collections.abc import Generator, Iterable

import bpy

from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.output.results.answer import sentence
from ..core.output.results.placement_record import relevant_warnings
from ..core.site.check import Problem, SceneContents, SiteCheck, check_site
from ..core.site.scene_geometry import SceneGeometry
from ..core.site.site import Site
from ..core.workflows.survey import lay_out
from ..core.workflows.survey_settings import SurveySettings
from ..scene.changes import watch
from ..scene.check import contents_of
from . import scene_status
from .layout import Status, draw_reason, draw_run, draw_sentence
from .object_roles import InObjectMode
from .session import CheckedScene, session
from .work import Job, LongWork, ShortWork, select_alone

SHOW_WIDTH = 28.0
"""Width of the button next to a problem, pixels at the usual scale of the interface."""


class SEIP_OT_check_site(LongWork, bpy.types.Operator):
    """Count the objects by role, and list problems that prevent a placement or make it wrong"""

    def job(self, scene: bpy.types.Scene) -> Job:
        """Check the scene as it is now, and hold what was found."""
        watching, settings = watch(scene), scene_status.survey_settings(scene)
        scene, found = yield _checked(contents_of(scene), settings)
        session.of(scene).check = CheckedScene(found, watching, settings)
        bpy.context.window_manager.seip_sections.follow_steps(scene)
        self.report({"INFO"}, in_short(found.problems))


def _checked(contents: SceneContents, settings: SurveySettings | str) -> Generator[Progress, None, SiteCheck]:
    """Check a scene."""

    def laid_out(geometry: SceneGeometry) -> tuple[Site, tuple[str, ...]]:
        if isinstance(settings, str):
            raise SeipError(settings)
        layout = lay_out(geometry, settings)
        keys = settings.candidates.sensors  # warnings about a type are shown with the type
        return layout.site, tuple(relevant_warnings(layout.warnings, keys, ()))

    return (yield from check_site(contents, laid_out))


def in_short(problems: Iterable[Problem]) -> str:
    """Return the number of errors and warnings as text; "no problem" where there is none."""
    kinds = [problem.severity == "ERROR" for problem in problems]
    errors, warnings = counted(sum(kinds), "error"), counted(len(kinds) - sum(kinds), "warning")
    if not kinds:
        return "no problem"
    return f"{errors}, {warnings}" if any(kinds) else warnings


class SEIP_OT_show_problem(InObjectMode, ShortWork, bpy.types.Operator):
    """Select the object with the problem, and bring it into view"""

    bl_label = "Show Object"
    bl_options = {"REGISTER", "UNDO"}

    object: bpy.props.StringProperty(name="Object", description="Name of the object")

    def act(self, context: bpy.types.Context) -> None:
        """Select it alone, and frame it."""
        obj = context.view_layer.objects.get(self.object)
        if obj is None:
            raise SeipError(f"the object {self.object!r} is not in this view layer")
        if not obj.visible_get():
            raise SeipError(f"the object {self.object!r} is hidden: show it first")
        select_alone(context, obj)
        if context.area is not None and context.area.type == "VIEW_3D":
            region = next(region for region in context.area.regions if region.type == "WINDOW")
            with context.temp_override(region=region):
                bpy.ops.view3d.view_selected()


def status(scene: bpy.types.Scene) -> Status:
    """Return the problems that the check found, the number of targets and the name of the site for the header."""
    if scene_status.has_nothing(scene):
        return Status(result=("none yet",))
    check = session.of(scene).check
    if check is None:
        return Status(result=("not checked", scene.name))
    targets = [f"{check.found.counts['Targets'].partition(', ')[0]} points"] if "Targets" in check.found.counts else []
    changed = scene_status.stale_check(scene) not in {"", scene_status.OTHER_SENSORS}
    return Status(changed, (in_short(check.found.problems), *targets, scene.name))


def draw_check(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the button and one line, and the problems with a button each."""
    check = session.of(scene).check
    draw_run(layout, "seip.check_site")
    if check is None:
        return
    problems = check.found.problems
    doubt = scene_status.stale_check(scene)
    if doubt:
        draw_sentence(layout, doubt, icon="INFO" if doubt == scene_status.OTHER_SENSORS else "ERROR")
    elif not problems:
        draw_sentence(layout, "The site is sound.", icon="CHECKMARK")
    else:
        draw_sentence(layout, f"{in_short(problems)}:")
    column = layout.column()
    column.active = not doubt
    for problem in problems:
        row = column.row()
        icon = "CANCEL" if problem.severity == "ERROR" else "ERROR"
        draw_sentence(row.column(), sentence(problem.text), icon=icon, reserved=SHOW_WIDTH)
        button = row.row()
        button.enabled = bool(problem.obj)
        button.operator("seip.show_problem", text="", icon="ZOOM_SELECTED").object = problem.obj


def draw_contents(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw what the site contains, as the check has counted it."""
    check = session.of(scene).check
    draw_reason(layout, "" if check is not None else "Check the site to count its contents.")
    for what, value in check.found.counts.items() if check is not None else ():
        draw_sentence(layout, f"{what}: {value}")
