"""The step "Placement": the goal, the button, and the answer."""

from __future__ import annotations

from functools import partial

import bpy

from ..core.base.counts import counted, duration_text
from ..core.choosing.placement.objective import certificate, purpose
from ..core.choosing.placement.returns_summary import returns_text
from ..core.choosing.placement.scenarios import DEFAULT_COUNTS
from ..core.output.results.answer import answer, sentence, status_text
from ..core.output.results.placement_record import PlacementRecord, parsed_record, relevant_warnings
from ..core.site.obstruction import NO_OBSTACLES_MESSAGE
from ..operators.detection import no_python
from ..operators.results import no_placement
from ..operators.sensors import SEIP_MT_survey_presets
from ..scene.sensors import labelled_sensors
from ..state import scene_status
from ..state.sensor_edits import sensor_edits
from ..state.session import session
from .sections import BETWEEN, Status, draw_sections
from .sidebar import RowList, draw_path, draw_reason, draw_run, draw_runs, draw_settings, is_narrow, settings_column
from .wrapped_text import BOX, draw_lines, draw_sentence, sidebar_width

_SHOWN = {
    "nominal": ("failures",),
    "pose-errors": ("risk", "position_error", "tilt_error", "failures"),
    "traffic": ("risk",),
}
"""Properties of the objective that are shown for each kind of scenarios."""

NAME_SHARE = 0.68
"""Share of a row that the name of a figure takes."""
NUMBER_SHARE = 0.3
"""Share of a row that a number of sensors takes, beside the bar of its coverage."""


class SEIP_UL_rules(RowList, bpy.types.UIList):
    """Positions with a demand of their own."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a position and what must be there."""
        row = layout.row()
        row.label(text=item.name, icon="CHECKMARK" if item.rule == "MANDATORY" else "CANCEL", translate=False)
        row.prop(item, "rule", text="")


def status(scene: bpy.types.Scene) -> Status:
    """Return quality, price and certificate of the placement for the header, and whether it is out of date."""
    if scene_status.has_unevaluated(scene):
        return Status(result=(counted(len(labelled_sensors(scene, hidden=True)), "sensor"), "not evaluated"))
    if no_placement(scene):
        return Status(result=("none yet",))
    parts = status_text(parsed_record(scene.seip.result.record)).split(BETWEEN)
    return Status(is_changed(scene) or bool(scene_status.other_goal(scene)), tuple(parts))


def is_changed(scene: bpy.types.Scene) -> bool:
    """Return whether the placement is known not to be of the scene as it is now."""
    return any(text != scene_status.NOT_COMPARED for text in _doubts(scene))


def _doubts(scene: bpy.types.Scene) -> list[str]:
    """Return why the placement is not, or may not be, of the scene as it is now."""
    return [text for text in (scene_status.stale_placement(scene), sensor_edits(scene).describe()) if text]


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the goal, the button and the answer, then the closed sections with all other settings."""
    scene = context.scene
    if draw_reason(layout, scene_status.NO_SITE if scene_status.has_nothing(scene) else ""):
        return
    goal = scene.seip.goal
    column = settings_column(layout)
    row = column.row()
    row.use_property_split = False  # else there is no room for three words
    if is_narrow(context):
        row.prop(goal, "limit", text="")
    else:
        row.prop(goal, "limit", expand=True)  # an empty text would leave each segment without its name
    column.prop(goal, goal.limit.lower())
    draw_run(layout, "seip.solve_placement", text=button_text(scene))
    obstacle = scene_status.obstacle(scene)
    if obstacle:
        draw_sentence(layout, obstacle, icon="ERROR")
    elif (check := session.of(scene).check) and not scene_status.stale_check(scene):
        for problem in check.found.problems:  # the result says little of a real site: not only in a closed section
            if problem.text == NO_OBSTACLES_MESSAGE:
                draw_sentence(layout, sentence(problem.text), icon="ERROR")
    if not no_placement(scene):
        _draw_answer(layout, scene)
    elif scene_status.has_unevaluated(scene):
        draw_sentence(layout, scene_status.UNEVALUATED, icon="INFO")
        draw_run(layout, "seip.evaluate_sensors")
    if not no_python(scene):
        draw_run(layout, "seip.judge_placement")
    draw_sections(
        layout,
        {
            "objective": _draw_objective,
            "rules": _draw_rules,
            "candidates": _draw_candidates,
            "search": _draw_search,
        },
        scene,
    )


def button_text(scene: bpy.types.Scene) -> str:
    """Return what the button will do, and at most how long it takes, about."""
    goal = scene.seip.goal
    what = {
        "COUNT": f"Place {counted(goal.count, 'Sensor')}",
        "BUDGET": f"Place for ${goal.budget:,.0f}",
        "COVERAGE": f"Cover {goal.coverage:g}%",
    }[goal.limit]
    seconds = scene_status.search_seconds(scene)
    return what if seconds is None else f"{what}, up to {duration_text(5.0 * max(1.0, round(seconds / 5.0)))}"


def _draw_objective(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the criterion and the settings of the chosen scenarios."""
    goal = scene.seip.goal
    column = draw_settings(layout, goal, "criterion", "scenarios")
    if goal.scenarios == "traffic":
        draw_runs(column, scene)
    for name in _SHOWN[goal.scenarios]:
        column.prop(goal, name)
    if goal.scenarios == "nominal" or goal.risk == "none":
        return
    number = f"{DEFAULT_COUNTS[goal.scenarios][0]} {'instants' if goal.scenarios == 'traffic' else 'draws'}"
    draw_sentence(layout, f"Rays are cast from every candidate in {number}, which takes minutes.", icon="INFO")


def _draw_rules(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the weights of regions, and the positions that must, or must not, have a sensor."""
    goal = scene.seip.goal
    column = settings_column(layout)
    row = column.row()
    row.use_property_split = True  # a list has no room for its name within
    row.prop(goal, "weighting")
    if goal.weighting == "VALUE":
        column.prop(goal, "central_weight")
    column.prop(goal, "min_distance")
    if len(goal.rules):
        row = layout.row()
        rows = len(goal.rules)
        row.template_list(SEIP_UL_rules.__name__, "", goal, "rules", goal, "active_rule", rows=rows, maxrows=rows)
        row.operator("seip.remove_entry", text="", icon="REMOVE").of = "RULES"
    layout.prop(goal, "position", text="", icon="VIEWZOOM", placeholder="Position, or the selected pole")
    row = layout.row(align=True)
    row.operator("seip.add_rule", text="Sensor", icon="CHECKMARK").rule = "MANDATORY"
    row.operator("seip.add_rule", text="No Sensor", icon="CANCEL").rule = "FORBIDDEN"


def _draw_candidates(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw how the site is laid out and how rays are cast, with presets of all these settings."""
    survey = scene.seip.survey
    row = layout.row(align=True)
    row.menu(SEIP_MT_survey_presets.__name__, text=SEIP_MT_survey_presets.bl_label)
    row.operator("seip.add_survey_preset", text="", icon="ADD")
    row.operator("seip.add_survey_preset", text="", icon="REMOVE").remove_active = True
    for heading, names in (
        ("Road", ("grid", "delta")),
        ("Positions", ("spacing", "allow")),
        ("Weather", ("rain", "wet_road", "fog", *(["visibility"] if survey.fog else []))),
        ("Price", ("installed",)),
    ):
        layout.label(text=heading)
        draw_settings(layout, survey, *names)
    if survey.installed:
        draw_path(layout, survey, "installed_cost", placeholder="Shipped")


def _draw_search(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the solver and its limit."""
    draw_settings(layout, scene.seip.survey, "solver", "effort")


def _draw_answer(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the answer in three lines and its details, after the reasons why it is not of the scene as it is."""
    record = parsed_record(scene.seip.result.record)
    box = layout.box()
    doubts = _doubts(scene)
    for text in doubts:
        draw_sentence(box, text, icon="ERROR", reserved=BOX)
    stale = scene_status.stale_placement(scene)
    if stale and stale != scene_status.ANOTHER_SITE:
        draw_run(box, "seip.compare_scene")
    if sensor_edits(scene).describe():
        draw_run(box, "seip.evaluate_sensors")
    other_goal = "" if doubts else scene_status.other_goal(scene)
    if other_goal:
        draw_sentence(box, other_goal, icon="INFO", reserved=BOX)
    column = box.column()
    if doubts:  # dimmed text could not be read in a light theme
        draw_sentence(column, "Figures of the last placement:", reserved=BOX)
    if scene.seip.result.change:
        draw_sentence(column, scene.seip.result.change, icon="INFO", reserved=BOX)
    for text in answer(record):
        draw_sentence(column, text, reserved=BOX)
    others = {"numbers": partial(_draw_numbers, goal=scene.seip.goal)} if numbers(record) else {}
    draw_sections(box, {**others, "details": partial(_draw_details, certain=not doubts)}, record)


def _draw_numbers(layout: bpy.types.UILayout, record: PlacementRecord, *, goal: bpy.types.PropertyGroup) -> None:
    """Draw quality and price of the best placement of each number of sensors, with a button that chooses it."""
    column = layout.column(align=True)
    for count, share, text in numbers(record):
        row = column.split(factor=NUMBER_SHARE, align=True)
        button = row.operator(
            "seip.choose_number",
            text=str(count),
            icon="CHECKMARK" if count == len(record.sensors) else "BLANK1",
            depress=goal.limit == "COUNT" and goal.count == count,
        )
        button.count = count
        row.progress(factor=share, text=text)
    draw_sentence(layout, front_text(record), icon="INFO", reserved=BOX)


def numbers(record: PlacementRecord) -> list[tuple[int, float, str]]:
    """Return numbers of sensors, each with the length of its bar and its quality and price as text."""
    if record.returns is None:
        return [(point.count, point.coverage, f"{point.coverage:.1%} · ${point.price:,.0f}") for point in record.front]
    front = record.returns.front
    most = max((point.returns for point in front), default=0.0) or 1.0
    return [
        (point.count, point.returns / most, f"{returns_text(point.returns)} · ${point.price:,.0f}") for point in front
    ]


def front_text(record: PlacementRecord) -> str:
    """Return what the placements of other numbers of sensors are, and how much better they could be."""
    if record.returns is not None:
        gaps = [point.gap for point in record.returns.front]
        if None in gaps:
            limit = "Not every number is proven."
        else:
            most = max(gap for gap in gaps if gap is not None)
            limit = f"Others have at most {most:.1%} more." if most else "No other has more."
        return f"Returns per revolution and price of the best placement found for each number. {limit}"
    what = "Coverage by weight" if record.objective.kind == "weighted" else "Coverage"
    missed = max(point.missed for point in record.front)
    limit = f"Others see at most {missed:.1%} of the road more." if missed else "No other sees more."
    return f"{what} and price of the best placement found for each number. {limit}"


def _draw_details(layout: bpy.types.UILayout, record: PlacementRecord, *, certain: bool) -> None:
    """Draw all figures by topic, the certificate while it holds, and the notes."""
    for topic, lines in figures(record).items():
        if not lines:
            continue
        layout.label(text=topic)
        column = layout.column(align=True)
        for name, value in lines:
            row = column.split(factor=NAME_SHARE)
            draw_sentence(row, name, reserved=BOX + (1.0 - NAME_SHARE) * sidebar_width())
            draw_lines(row, [value])
    if certain:
        objective, notes = record.objective, record.notes
        proven = objective.status == "optimal" and not purpose(notes)  # of the coverage that is shown above
        proof = certificate(objective.status, objective.gap, cheapest=objective.cheapest, notes=notes)
        draw_sentence(layout, proof, icon="CHECKMARK" if proven else "INFO", reserved=BOX)
    for note in (*record.notes, *_warnings(record)):
        draw_sentence(layout, sentence(note), icon="INFO", reserved=BOX)


def figures(record: PlacementRecord) -> dict[str, list[tuple[str, str]]]:
    """Return the figures of a placement as text, by topic."""
    coverage, objective = record.coverage, record.objective
    seen = [("Road", f"{coverage.whole:.2%}")]
    if coverage.central is not None:
        seen.append(("In weighted regions", f"{coverage.central:.2%}"))
    if objective.kind == "weighted":
        seen.append(("By weight", f"{coverage.weighted:.2%}"))
    if coverage.gain_band is not None and coverage.gain_band.sheets:
        seen.append(("With plausible gains", f"{coverage.gain_band.low:.0%} to {coverage.gain_band.high:.0%}"))
    returns: list[tuple[str, str]] = []
    crossings: list[tuple[str, str]] = []
    if record.returns is not None:
        returns = [(name.capitalize(), returns_text(number)) for name, number in record.returns.of_each.items()]
        crossings = [(crossing.name, returns_text(crossing.least)) for crossing in record.returns.crossings]
    price = [(sensor.id, f"${sensor.price_usd:,.0f}") for sensor in record.sensors]
    return {
        "Seen": seen,
        "Returns in Each Revolution": returns,
        "Pedestrian's Returns at Worst Point": crossings,
        "Price": [*price, ("Total", record.price_text)],
    }


def _warnings(record: PlacementRecord) -> list[str]:
    """Return the warnings about the site; those about a sensor type are shown with the type."""
    return relevant_warnings(record.warnings, record.request.candidates.sensors, ())
