"""The objective of a placement: goal, criterion, conditions, and rules for single positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.base.errors import SeipError
from ..core.choosing.placement.objective import DEFAULT_COUNT, Objective
from ..core.choosing.placement.scenarios import DEFAULT_COUNTS, Scenarios
from ..core.sensing.scenarios.pose_errors import MAX_ANGLE_STD, PoseErrors
from ..scene import contract
from .layout import RowList, draw_list, draw_runs, draw_sentence, draw_settings, settings_column
from .properties import as_typed, of_setting
from .session import session
from .work import ShortWork

RULE_ITEMS = (("MANDATORY", "Sensor", "There must be a sensor"), ("FORBIDDEN", "No sensor", "There must be none"))
_SHOWN = {
    "nominal": ("failures",),
    "pose-errors": ("risk", "position_error", "tilt_error", "failures"),
    "traffic": ("risk",),
}
"""Properties of the objective that are shown for each kind of scenarios."""


class SEIP_PG_position_rule(bpy.types.PropertyGroup):
    """A position with a demand of its own; its name is the position's."""

    rule: EnumProperty(name="Rule", description="Requirement at this position", items=RULE_ITEMS)


class SEIP_PG_goal(bpy.types.PropertyGroup):
    """Objective of a placement."""

    limit: EnumProperty(
        name="Goal",
        description="Limit of the placement",
        items=(
            ("COUNT", "Number", "The most coverage for a number of sensors"),
            ("BUDGET", "Budget", "The most coverage for a sum of money"),
            ("COVERAGE", "Coverage", "A coverage for the least money"),
        ),
    )
    count: IntProperty(name="Sensors", description="Largest number of sensors", default=DEFAULT_COUNT, min=1)
    budget: FloatProperty(
        name="Budget ($)", description="Largest total price in US dollars", default=50000.0, min=0.0, step=100000
    )
    coverage: FloatProperty(
        name="Coverage",
        description="Share of the targets to be seen, in per cent",
        subtype="PERCENTAGE",
        default=90.0,
        min=0.1,
        max=100.0,
    )
    weighting: EnumProperty(
        name="Weights",
        description="Weighting of targets in weighted regions",
        items=(
            ("NONE", "Uniform", "Every target counts the same"),
            ("SCENE", "Weights of Regions", "Each region's own weight counts"),
            ("VALUE", "One Weight", "One weight for all weighted regions"),
        ),
    )
    central_weight: FloatProperty(
        name="Weight", description="Weight of targets in weighted regions; others have 1", default=2.0, min=0.001
    )
    min_distance: of_setting(Objective, "min_distance", "Least Distance")
    criterion: of_setting(
        Objective,
        "criterion",
        "Maximise",
        items=(
            ("auto", "Automatic", "Returns from road users for products, the road seen for the paper's sensor types"),
            ("road", "Road Seen", "The share of the road that sensors see"),
            ("returns", "Returns", "The expected returns from cars, cyclists and pedestrians"),
        ),
    )
    scenarios: EnumProperty(
        name="Conditions",
        description="Conditions that the placement is optimised for",
        items=(
            ("nominal", "As Planned", "Sensors exactly where they are planned, on the empty road"),
            ("pose-errors", "Mounting Errors", "Random errors of the sensors' positions and tilts"),
            ("traffic", "Traffic", "Instants of traffic at which vehicles block the view"),
        ),
    )
    risk: of_setting(
        Objective,
        "risk",
        "Average Over",
        items=(
            ("auto", "Automatic", "The worst quarter of mounting errors, all instants of traffic"),
            ("none", "Evaluate Only", "Optimise for sensors as planned on the empty road, and report the loss"),
            ("mean", "All Cases", "Mean over all cases"),
            ("worst-quarter", "Worst Quarter", "Mean over the worst quarter of the cases"),
            ("worst", "Worst Case", "The worst case only"),
        ),
    )
    position_error: of_setting(PoseErrors, "position", "Position Error", min=0.0)
    tilt_error: of_setting(PoseErrors, "tilt", "Tilt Error", min=0.0, max=MAX_ANGLE_STD)
    failures: of_setting(
        Objective,
        "failures",
        "Sensor Failure",
        items=(
            ("none", "None", "All sensors work"),
            ("worst", "Worst Sensor", "The sensor that matters most has failed"),
            ("mean", "Any Sensor", "Mean over the failures of each sensor"),
        ),
    )
    rules: CollectionProperty(type=SEIP_PG_position_rule)
    active_rule: IntProperty(name="Position")
    position: StringProperty(
        name="Position",
        description="Name of a position, as laid out: type to search",
        search=search_positions,
    )

    def objective(self) -> Objective:
        """Return the objective that the panel states.

        Raises
        ------
        SeipError
            Its parts contradict each other.
        """
        nominal = self.scenarios == "nominal"
        return Objective(
            count=self.count if self.limit == "COUNT" else None,
            budget=as_typed(self.budget) if self.limit == "BUDGET" else None,
            coverage=as_typed(self.coverage) / 100 if self.limit == "COVERAGE" else None,
            central_weight=self._weight(),
            min_distance=as_typed(self.min_distance),
            criterion=self.criterion,
            forbidden=tuple(one.name for one in self.rules if one.rule == "FORBIDDEN"),
            mandatory=tuple(one.name for one in self.rules if one.rule == "MANDATORY"),
            scenarios=self._scenarios(),
            risk="auto" if nominal else self.risk,
            failures="none" if self.scenarios == "traffic" else self.failures,
        )

    def take_over(self, goal: Objective) -> None:
        """Take over an objective, as far as the panel has its parts."""
        self.limit = "COUNT" if goal.coverage is None else "COVERAGE"
        if goal.count is None and goal.budget is not None:
            self.limit = "BUDGET"
        self.count, self.budget = goal.count or DEFAULT_COUNT, goal.budget or self.budget
        self.coverage = self.coverage if goal.coverage is None else 100 * goal.coverage
        self.weighting = "NONE" if goal.central_weight is None else "VALUE"
        if goal.central_weight == "scene":
            self.weighting = "SCENE"
        elif goal.central_weight is not None:
            self.central_weight = goal.central_weight
        self.rules.clear()
        for rule, names in (("FORBIDDEN", goal.forbidden), ("MANDATORY", goal.mandatory)):
            for name in names:
                entry = self.rules.add()
                entry.name, entry.rule = name, rule
        errors = goal.scenarios.pose_errors
        self.scenarios, self.position_error, self.tilt_error = goal.scenarios.kind, errors.position, errors.tilt
        for name in ("min_distance", "criterion", "risk", "failures"):
            setattr(self, name, getattr(goal, name))

    def _scenarios(self) -> Scenarios:
        if self.scenarios == "traffic":
            return Scenarios("traffic")
        if self.scenarios == "pose-errors":
            position, tilt = as_typed(self.position_error), as_typed(self.tilt_error)
            return Scenarios("pose-errors", PoseErrors(position, position, tilt, tilt))
        return Scenarios()

    def _weight(self) -> float | Literal["scene"] | None:
        if self.weighting == "SCENE":
            return "scene"
        return as_typed(self.central_weight) if self.weighting == "VALUE" else None


def search_positions(_goal: bpy.types.PropertyGroup, context: bpy.types.Context, text: str) -> Iterator[str]:
    """Yield the names of positions that hold a text: those that were laid out, or else the poles."""
    scene = context.scene
    state = session.of(scene).state
    if state is not None:
        names = state.layout.site.candidates.position_name.tolist()
    else:
        names = sorted(obj.name for obj in contract.members(scene)[contract.POLES])
    yield from (name for name in names if text.lower() in name.lower())


def position_of(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> str:
    """Return the name of the position that an object stands for: a sensor's, or a pole's own; empty if for none."""
    while obj is not None:
        if contract.POSITION in obj:
            return str(obj[contract.POSITION])
        if obj in contract.members(scene)[contract.POLES]:
            return str(obj.name)
        obj = obj.parent
    return ""


class SEIP_OT_choose_number(ShortWork, bpy.types.Operator):
    """Make this number of sensors the goal of the next placement; the tick marks the present placement"""

    bl_label = "Choose Number of Sensors"
    bl_options = {"REGISTER", "UNDO"}

    count: bpy.props.IntProperty(name="Sensors", description="Largest number of sensors", min=1, default=1)

    def act(self, context: bpy.types.Context) -> None:
        """Set the goal."""
        goal = context.scene.seip.goal
        goal.limit, goal.count = "COUNT", self.count


class SEIP_OT_add_rule(ShortWork, bpy.types.Operator):
    """Require or forbid a sensor at the position of the selected pole or sensor, or at the named one"""

    bl_options = {"REGISTER", "UNDO"}

    rule: bpy.props.EnumProperty(name="Rule", description="Requirement at the position", items=RULE_ITEMS)

    def act(self, context: bpy.types.Context) -> None:
        """Add it, or change the one that is there."""
        rule = self.rule
        goal = context.scene.seip.goal
        name = goal.position or position_of(context.scene, context.object)
        if not name:
            raise SeipError("name a position, or select a pole or a sensor")
        entry = goal.rules.get(name) or goal.rules.add()
        entry.name, entry.rule = name, rule
        goal.active_rule = goal.rules.find(name)
        goal.position = ""


class SEIP_UL_rules(RowList, bpy.types.UIList):
    """Positions with a demand of their own."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a position and what must be there."""
        row = layout.row()
        row.label(text=item.name, icon="CHECKMARK" if item.rule == "MANDATORY" else "CANCEL", translate=False)
        row.prop(item, "rule", text="")


def draw_objective(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
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


def draw_rules(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
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
        draw_list(row, SEIP_UL_rules, goal, "rules", "active_rule")
        row.operator("seip.remove_entry", text="", icon="REMOVE").of = "RULES"
    layout.prop(goal, "position", text="", icon="VIEWZOOM", placeholder="Position, or the selected pole")
    row = layout.row(align=True)
    row.operator("seip.add_rule", text="Sensor", icon="CHECKMARK").rule = "MANDATORY"
    row.operator("seip.add_rule", text="No Sensor", icon="CANCEL").rule = "FORBIDDEN"
