"""Properties of the placement: what is asked of it."""

from __future__ import annotations

from typing import Literal

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from .. import selection
from ..core.placement.objective import DEFAULT_COUNT, Objective
from ..core.robustness.pose_errors import MAX_ANGLE_STD, PoseErrors
from ..core.robustness.risk import Risk
from ..core.robustness.robust_study import RobustnessSettings
from ..core.robustness.traffic_study import LAYER_NAMES
from ..core.workflows.traffic import TrafficSettings
from .conversion import as_typed, of_setting

TAILS = {"EXPECTED": 1.0, "CVAR": 0.25, "WORST": 0.0}
"""Share of the scenarios, the worst ones, that count, by objective."""


class SEIP_PG_position_rule(bpy.types.PropertyGroup):
    """A position with a demand of its own; its name is the position's."""

    rule: EnumProperty(
        name="Rule",
        description="What must be at this position",
        items=(("MANDATORY", "Sensor", "There must be a sensor"), ("FORBIDDEN", "No sensor", "There must be none")),
    )


class SEIP_PG_goal(bpy.types.PropertyGroup):
    """What is asked of a placement."""

    limit: EnumProperty(
        name="Goal",
        description="What limits the placement",
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
        description="How targets in weighted regions count",
        items=(
            ("NONE", "Uniform", "Every target counts the same"),
            ("SCENE", "Weights of Regions", "Each region's own weight counts"),
            ("VALUE", "One Weight", "One weight for all weighted regions"),
        ),
    )
    central_weight: FloatProperty(
        name="Weight", description="Of targets in weighted regions, where others have 1", default=2.0, min=0.001
    )
    min_distance: of_setting(Objective, "min_distance", "Min. Distance")
    criterion: of_setting(
        Objective,
        "criterion",
        "Criterion",
        items=(
            ("auto", "By Sensor", "Returns if a sensor has a range law, as real ones have; otherwise road seen"),
            ("road", "Road Seen", "The share of the road that sensors see"),
            ("returns", "Returns", "The expected returns from cars, cyclists and pedestrians"),
        ),
    )
    objective: EnumProperty(
        name="Optimise for",
        description="Whether the placement trusts the map, or is chosen for what may go wrong",
        items=(
            ("PLANNED", "Nominal Poses", "The coverage of sensors that hang just where they should"),
            ("EXPECTED", "Expected Coverage", "Coverage on average over poses that err"),
            ("CVAR", "CVaR of the Worst Quarter", "Coverage on average over the worst quarter of poses that err"),
            ("WORST", "Worst Case", "Coverage in the worst of the poses that were tried"),
            ("TRAFFIC", "Coverage in Traffic", "Coverage on average over instants at which vehicles block the view"),
        ),
    )
    position_error: of_setting(PoseErrors, "position", "Position Error", min=0.0)
    tilt_error: of_setting(PoseErrors, "tilt", "Tilt Error", min=0.0, max=MAX_ANGLE_STD)
    seen_by: of_setting(Risk, "seen_by", "Seen by", max=8)
    failure: EnumProperty(
        name="Sensor Failure",
        description="Whether coverage is counted after one of the sensors has failed",
        items=(
            ("none", "None", "All of them work"),
            ("worst", "Worst Sensor", "The one that is missed most has failed"),
            ("mean", "Any Sensor", "On average over all of them"),
        ),
    )
    runs: StringProperty(
        name="Runs",
        description="Folder with runs of traffic (.npz), two or more: the last third evaluates what is chosen on the "
        "others. Empty for the folder SCENE_traffic beside the file",
        subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    layer: of_setting(
        TrafficSettings,
        "layer",
        "See",
        items=(
            ("road", "Road", f"The {LAYER_NAMES['road']}"),
            ("height", "Vehicles' Height", f"The {LAYER_NAMES['height']}"),
        ),
    )
    weights_from_traffic: of_setting(TrafficSettings, "weights_from_traffic", "Weights from Traffic")
    instants: of_setting(TrafficSettings, "instants", "Instants")
    evaluation_instants: of_setting(TrafficSettings, "evaluation_instants", "Evaluated At")
    pose_errors: BoolProperty(
        name="Test Pose Errors",
        description="Note with the placement what it loses where sensors do not hang quite as planned; this casts rays",
        default=False,
    )
    rules: CollectionProperty(type=SEIP_PG_position_rule)
    active_rule: IntProperty(name="Position")
    position: StringProperty(
        name="Position",
        description="Name of a position, as laid out: type to search",
        search=selection.search_positions,
    )

    def goal(self) -> Objective:
        """Return what is asked, as the core takes it.

        Raises
        ------
        SeipError
            It contradicts itself.
        """
        return Objective(
            count=self.count if self.limit == "COUNT" else None,
            budget=as_typed(self.budget) if self.limit == "BUDGET" else None,
            coverage=as_typed(self.coverage) / 100 if self.limit == "COVERAGE" else None,
            central_weight=self._weight(),
            min_distance=as_typed(self.min_distance),
            criterion=self.criterion if self.objective == "PLANNED" and self.limit != "COVERAGE" else "auto",
            forbidden=tuple(one.name for one in self.rules if one.rule == "FORBIDDEN"),
            mandatory=tuple(one.name for one in self.rules if one.rule == "MANDATORY"),
        )

    def robustness(self) -> RobustnessSettings | None:
        """Return what the placement is to stand, None where it trusts the poses.

        Raises
        ------
        SeipError
            It makes no sense.
        """
        if self.objective not in TAILS:
            return None
        position, tilt = as_typed(self.position_error), as_typed(self.tilt_error)
        risk = Risk(TAILS[self.objective], self.seen_by, self.failure)
        return RobustnessSettings(risk, PoseErrors(position, position, tilt, tilt))

    def traffic(self) -> TrafficSettings | None:
        """Return how the placement is chosen on traffic, None where it is not."""
        if self.objective != "TRAFFIC":
            return None
        return TrafficSettings(self.layer, self.weights_from_traffic, self.instants, self.evaluation_instants)

    def _weight(self) -> float | Literal["scene"] | None:
        if self.weighting == "SCENE":
            return "scene"
        return as_typed(self.central_weight) if self.weighting == "VALUE" else None


CLASSES = (SEIP_PG_position_rule, SEIP_PG_goal)
