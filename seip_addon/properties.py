"""What the panel asks and what it found, kept with each scene in the file."""

from __future__ import annotations

from typing import Literal

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import pointing, state
from .core.candidates import CandidateSettings, heights_of
from .core.goal import DEFAULT_COUNT, Goal
from .core.survey import SurveySettings
from .core.visibility.grid import VisibilitySettings
from .preferences import catalogue_files

_LAYOUT, _SIGHT, _SURVEY = CandidateSettings(), VisibilitySettings(), SurveySettings()


class SEIP_PG_sensor_type(bpy.types.PropertyGroup):
    """A type of sensor that may be chosen; its name is its key in the catalogue."""

    use: BoolProperty(name="Use", description="Let the placement choose sensors of this type", default=True)


class SEIP_PG_survey(bpy.types.PropertyGroup):
    """How the site is laid out and when a target counts as seen."""

    types: CollectionProperty(type=SEIP_PG_sensor_type)
    active_type: IntProperty(name="Sensor type")
    heights: StringProperty(
        name="Heights (m)",
        description="Mounting heights above the ground in metres, like 3.5 5.4 8, or a range FROM:TO:STEP",
        default=" ".join(f"{height:g}" for height in _LAYOUT.heights),
    )
    grid: FloatProperty(
        name="Target Grid",
        description="Distance between neighbouring targets on the road",
        unit="LENGTH",
        default=_SURVEY.grid_spacing,
        min=0.05,
        soft_max=10.0,
        step=10,
    )
    delta: FloatProperty(
        name="δ",
        description="A return nearer than this to a target sees it",
        unit="LENGTH",
        default=_SIGHT.delta,
        min=0.01,
        max=100.0,
        soft_max=5.0,
        step=10,
    )
    min_intensity: FloatProperty(
        name="Least Intensity",
        description="Least intensity of a return that sees; at 0 every return counts",
        subtype="FACTOR",
        default=_SIGHT.min_intensity,
        min=0.0,
        max=1.0,
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Least distance between two new posts on the pavement",
        unit="LENGTH",
        default=_LAYOUT.spacing,
        min=0.1,
        soft_max=50.0,
        step=50,
    )
    setback: FloatProperty(
        name="Setback",
        description="Distance of new posts from the kerb",
        unit="LENGTH",
        default=_LAYOUT.setback,
        min=0.0,
        soft_max=5.0,
        step=10,
    )
    clearance: FloatProperty(
        name="Clearance",
        description="Distance of new posts and their sensors from walls and other objects",
        unit="LENGTH",
        default=_LAYOUT.clearance,
        min=0.0,
        soft_max=5.0,
        step=10,
    )
    bracket: FloatProperty(
        name="Bracket",
        description="How far from an existing pole's axis a sensor hangs",
        unit="LENGTH",
        default=_LAYOUT.bracket,
        min=0.0,
        soft_max=5.0,
        step=10,
    )
    engine: EnumProperty(
        name="Ray Caster",
        description="What casts the rays",
        items=(
            ("auto", "Automatic", "Embree where it is installed, else BVHTree"),
            ("embree", "Embree", "The faster one"),
            ("bvh", "BVHTree", "Blender's own"),
        ),
        default="auto",
    )
    solver: EnumProperty(
        name="Solver",
        description="What solves the integer program",
        items=(
            ("auto", "Automatic", "HiGHS where it is installed, else CBC"),
            ("highs", "HiGHS", "Comes with the extension"),
            ("cbc", "CBC", "Comes with PuLP"),
            ("gurobi", "Gurobi", "Needs your own installation and licence"),
        ),
        default="auto",
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="For the search of a placement, in seconds",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        default=_SURVEY.time_limit,
        min=1.0,
        soft_max=3600.0,
    )

    def settings(self) -> SurveySettings:
        """Return what is asked, as the core takes it.

        Raises
        ------
        SeipError
            It makes no sense.
        """
        used = tuple(one.name for one in self.types if one.use)
        return SurveySettings(
            candidates=CandidateSettings(
                sensors=used if len(self.types) else _LAYOUT.sensors,
                heights=heights_of(self.heights.split()),
                spacing=_written(self.spacing),
                setback=_written(self.setback),
                clearance=_written(self.clearance),
                bracket=_written(self.bracket),
            ),
            visibility=VisibilitySettings(_written(self.delta), _written(self.min_intensity)),
            grid_spacing=_written(self.grid),
            catalogue=catalogue_files(),
            engine=self.engine,
            solver=self.solver,
            time_limit=_written(self.time_limit),
        )


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
            ("NONE", "All Alike", "Every target counts the same"),
            ("SCENE", "By Region", "Each region's own weight counts"),
            ("VALUE", "One Value", "One weight for all weighted regions"),
        ),
    )
    central_weight: FloatProperty(
        name="Weight", description="Of targets in weighted regions, where others have 1", default=2.0, min=0.001
    )
    min_distance: FloatProperty(
        name="Least Distance", description="Between two sensors", unit="LENGTH", default=0.0, min=0.0
    )
    rules: CollectionProperty(type=SEIP_PG_position_rule)
    active_rule: IntProperty(name="Position")
    position: StringProperty(
        name="Position",
        description="Name of a position, as laid out: type to search",
        search=pointing.search_positions,
    )

    def goal(self) -> Goal:
        """Return what is asked, as the core takes it.

        Raises
        ------
        SeipError
            It contradicts itself.
        """
        return Goal(
            count=self.count if self.limit == "COUNT" else None,
            budget=_written(self.budget) if self.limit == "BUDGET" else None,
            coverage=_written(self.coverage) / 100 if self.limit == "COVERAGE" else None,
            central_weight=self._weight(),
            min_distance=_written(self.min_distance),
            forbidden=tuple(one.name for one in self.rules if one.rule == "FORBIDDEN"),
            mandatory=tuple(one.name for one in self.rules if one.rule == "MANDATORY"),
        )

    def _weight(self) -> float | Literal["scene"] | None:
        if self.weighting == "SCENE":
            return "scene"
        return _written(self.central_weight) if self.weighting == "VALUE" else None


class SEIP_PG_chosen(bpy.types.PropertyGroup):
    """A sensor of the placement; its name is its label."""


class SEIP_PG_ranked(bpy.types.PropertyGroup):
    """A candidate pose in a ranking; its name says where it is."""

    pose: IntProperty(name="Pose", description="Number of the candidate pose")
    share: FloatProperty(name="Share", description="Of the targets' weight that it sees, or adds", subtype="FACTOR")


class SEIP_PG_placement(bpy.types.PropertyGroup):
    """A placement: enough to find all about it again from the scene and the visibility kept in the cache."""

    record: StringProperty(name="Record", description="The placement as placement.json holds it")
    targets: StringProperty(name="Targets", description="Digest of the targets that it was made on")
    seen: StringProperty(name="Seen", description="By how many sensors each target is seen, packed")


class SEIP_PG_result(SEIP_PG_placement):
    """The placement that stands in the scene, and what is looked at of it."""

    sensors: CollectionProperty(type=SEIP_PG_chosen)
    active_sensor: IntProperty(
        name="Sensor",
        description="Click to select the sensor in the scene",
        update=pointing.select_sensor,
    )
    order: EnumProperty(
        name="Order",
        description="By what candidates are ranked",
        items=(
            ("ADDED", "Added", "What a pose would add to the placement, at positions that are free"),
            ("ALONE", "Alone", "What a pose sees by itself"),
        ),
    )
    ranking: CollectionProperty(type=SEIP_PG_ranked)
    active_ranked: IntProperty(
        name="Candidate",
        description="Click to put the 3D cursor at the candidate",
        update=pointing.show_candidate,
    )
    folder: StringProperty(
        name="Folder",
        description="Where the result is written; // is the folder of the .blend",
        subtype="DIR_PATH",
        default="//seip-result/",
    )
    render: BoolProperty(
        name="Rendered View", description="Render a view of the scene as well, which takes a minute", default=False
    )


class SEIP_PG_scene(bpy.types.PropertyGroup):
    """All that SEIP keeps with a scene."""

    version: IntProperty(name="Version", default=state.VERSION, options={"HIDDEN"})
    survey: PointerProperty(type=SEIP_PG_survey)
    goal: PointerProperty(type=SEIP_PG_goal)
    result: PointerProperty(type=SEIP_PG_result)
    kept: CollectionProperty(type=SEIP_PG_placement)
    active_kept: IntProperty(name="Kept Placement", description="The one that the present placement is compared with")


def _written(value: float) -> float:
    """Return the number that a person typed: Blender keeps it in single precision, 0.3 as 0.30000001."""
    return float(f"{value:.7g}")


CLASSES = (
    SEIP_PG_sensor_type,
    SEIP_PG_survey,
    SEIP_PG_position_rule,
    SEIP_PG_goal,
    SEIP_PG_chosen,
    SEIP_PG_ranked,
    SEIP_PG_placement,
    SEIP_PG_result,
    SEIP_PG_scene,
)


def attach() -> None:
    """Give every scene its properties."""
    bpy.types.Scene.seip = PointerProperty(type=SEIP_PG_scene)


def detach() -> None:
    """Take them away."""
    del bpy.types.Scene.seip
