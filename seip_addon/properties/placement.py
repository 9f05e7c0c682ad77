"""Properties of the placement: its objective."""

from __future__ import annotations

from typing import Literal

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.choosing.placement.objective import DEFAULT_COUNT, Objective
from ..core.choosing.placement.scenarios import Scenarios
from ..core.sensing.scenarios.pose_errors import MAX_ANGLE_STD, PoseErrors
from ..state import selection
from .conversion import as_typed, of_setting

RULE_ITEMS = (("MANDATORY", "Sensor", "There must be a sensor"), ("FORBIDDEN", "No sensor", "There must be none"))


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
        search=selection.search_positions,
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
