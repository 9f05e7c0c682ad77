"""Scene properties: settings of the panel, and results kept in the file."""

from __future__ import annotations

import math
from pathlib import Path
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

from . import pointing, scans, state
from .core.datasets import FORMATS, SPLITS
from .core.placement.objective import DEFAULT_COUNT, Objective
from .core.robustness.pose_errors import STEEPEST, WIDEST, PoseErrors
from .core.robustness.risk import Risk
from .core.robustness.robust_study import RobustnessSettings
from .core.scans import ScanSettings
from .core.site.candidates import HIGHEST, CandidateSettings, heights_of, tilts_of
from .core.site.scene_geometry import DEFAULT_WEIGHT
from .core.streetscape.description import DEFAULT_RADIUS, DESCRIPTION_SUFFIX
from .core.traffic.source import TrafficFiles
from .core.visibility.grid import VisibilitySettings
from .core.workflows.recording import RecordingSettings
from .core.workflows.survey import SurveySettings
from .preferences import catalogue_files
from .scene import contract, roles

TAILS = {"EXPECTED": 1.0, "CVAR": 0.25, "WORST": 0.0}
"""Share of the scenarios, the worst ones, that count, by objective."""

_LAYOUT, _SIGHT, _SURVEY = CandidateSettings(), VisibilitySettings(), SurveySettings()
_TILTS = " ".join(f"{math.degrees(tilt):g}" for tilt in _LAYOUT.tilts)


class SEIP_PG_junction(bpy.types.PropertyGroup):
    """A junction of the chosen map; its name is what the list shows."""

    id: StringProperty(name="Id", description="Of the junction, as in the map")


class SEIP_PG_count(bpy.types.PropertyGroup):
    """Something that the check counted; its name is what."""

    value: StringProperty(name="Count", description="How much there is")


class SEIP_PG_problem(bpy.types.PropertyGroup):
    """Something that the check found; its name is the object to look at, or empty."""

    is_error: BoolProperty(name="Error", description="Whether a survey cannot go on")
    text: StringProperty(name="Problem", description="What is wrong, and the cure")


def _show_problem(site: SEIP_PG_site, context: bpy.types.Context) -> None:
    """Select what was clicked at, and frame it; a problem of the scene has nothing to show."""
    if site.problems[site.active_problem].name and context.area is not None and bpy.ops.seip.show_problem.poll():
        bpy.ops.seip.show_problem()


ROLE_ITEMS = tuple((role.name, role.value.capitalize(), f"{roles.WORDS[role].capitalize()}") for role in roles.ROLES)


class SEIP_PG_site(bpy.types.PropertyGroup):
    """Where the site comes from, and what the check found in it."""

    source: StringProperty(
        name="Map",
        description="OpenDRIVE map, or site description that names one",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    junctions: CollectionProperty(type=SEIP_PG_junction)
    junction: StringProperty(
        name="Junction",
        description="In the middle of the site; empty for the middle of the map, or the description's own place",
    )
    region_shape: EnumProperty(
        name="Region",
        description="Which part of the road about the junction is to be seen",
        items=(
            ("APPROACHES", "Approaches", "The junction, and the streets that lead to it up to a distance along them"),
            ("CIRCLE", "Circle", "All road within a circle about the middle of the junction"),
        ),
    )
    radius: FloatProperty(
        name="Radius",
        description="Of the region of interest; or how far it follows the approaches of the junction",
        unit="LENGTH",
        default=DEFAULT_RADIUS,
        min=1.0,
        soft_max=500.0,
        step=1000,
    )
    role: EnumProperty(name="Role", description="What objects mean to the placement", items=ROLE_ITEMS)
    checked: BoolProperty(name="Checked", description="Whether the check has looked at this scene")
    counts: CollectionProperty(type=SEIP_PG_count)
    problems: CollectionProperty(type=SEIP_PG_problem)
    active_problem: IntProperty(
        name="Problem",
        description="Click to select the object and bring it into view",
        update=_show_problem,
    )

    def is_described(self) -> bool:
        """Return whether a site description says where the place is, and how large."""
        return self.source.lower().endswith(DESCRIPTION_SUFFIX) and not self.junction

    def follows_approaches(self) -> bool:
        """Return whether the region follows the approaches of a chosen junction."""
        return bool(self.junction) and self.region_shape == "APPROACHES"

    def junction_id(self) -> str | None:
        """Return the id of the chosen junction, what was typed where the map has no such, None where none is chosen."""
        if not self.junction:
            return None
        found = self.junctions.get(self.junction)
        return str(self.junction if found is None else found.id)


class SEIP_PG_sensor_type(bpy.types.PropertyGroup):
    """A type of sensor that may be chosen; its name is its key in the catalogue."""

    use: BoolProperty(name="Use", description="Let the placement choose sensors of this type", default=True)


class SEIP_PG_survey(bpy.types.PropertyGroup):
    """How the site is laid out and when a target counts as seen."""

    types: CollectionProperty(type=SEIP_PG_sensor_type)
    active_type: IntProperty(name="Sensor type", description="The type whose details are shown")
    preview_height: FloatProperty(
        name="Height",
        description="Of the previewed sensor above the 3D cursor",
        unit="LENGTH",
        default=5.4,
        min=0.1,
        max=HIGHEST,
        soft_max=20.0,
        step=10,
    )
    heights: StringProperty(
        name="Heights (m)",
        description="Mounting heights above the ground in metres, like 3.5 5.4 8, or a range FROM:TO:STEP",
        default=" ".join(f"{height:g}" for height in _LAYOUT.heights),
    )
    tilts: StringProperty(
        name="Tilts (°)",
        description="How far sensors may be turned nose down towards the region, in degrees, like 0 5 10, or a range "
        "FROM:TO:STEP; 0 is upright, negative is up",
        default=_TILTS,
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
    assumed_poles: BoolProperty(
        name="Assumed Poles",
        description="Let poles carry sensors that are assumed, since the map has none for its traffic lights",
        default=_LAYOUT.assumed_poles,
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
    effort: FloatProperty(
        name="Effort",
        description=(
            "Limit the search by counted work instead of time: about a second of one processor core for each unit, "
            "and the same placement again on every run. 0: limit the time"
        ),
        default=0.0,
        min=0.0,
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
                tilts=tilts_of(self.tilts.split()),
                spacing=_written(self.spacing),
                setback=_written(self.setback),
                clearance=_written(self.clearance),
                bracket=_written(self.bracket),
                assumed_poles=self.assumed_poles,
            ),
            visibility=VisibilitySettings(_written(self.delta), _written(self.min_intensity)),
            grid_spacing=_written(self.grid),
            catalogue=catalogue_files(),
            engine=self.engine,
            solver=self.solver,
            time_limit=math.inf if self.effort else _written(self.time_limit),
            effort=_written(self.effort) if self.effort else math.inf,
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
    objective: EnumProperty(
        name="Place for",
        description="Whether the placement trusts the map, or is chosen for what may go wrong",
        items=(
            ("PLANNED", "Poses as Planned", "The coverage of sensors that hang just where they should"),
            ("EXPECTED", "The Average", "Coverage on average over poses that err"),
            ("CVAR", "The Worst Quarter", "Coverage on average over the worst quarter of poses that err"),
            ("WORST", "The Worst Case", "Coverage in the worst of the poses that were tried"),
        ),
    )
    position_error: FloatProperty(
        name="Position Error",
        description="Standard deviation of x, of y and of the height",
        unit="LENGTH",
        default=PoseErrors().position,
        min=0.0,
        max=WIDEST,
    )
    tilt_error: FloatProperty(
        name="Tilt Error",
        description="Standard deviation of yaw, of pitch and of roll",
        subtype="ANGLE",
        default=PoseErrors().tilt,
        min=0.0,
        max=STEEPEST,
    )
    seen_by: IntProperty(name="Seen by", description="Sensors that must see a target", default=1, min=1, max=8)
    failure: EnumProperty(
        name="A Sensor Fails",
        description="Whether coverage is counted after one of the sensors has failed",
        items=(
            ("none", "None", "All of them work"),
            ("worst", "The Most Important", "The one that is missed most has failed"),
            ("mean", "Any", "On average over all of them"),
        ),
    )
    pose_errors: BoolProperty(
        name="Try Pose Errors",
        description="Note with the placement what it loses where sensors do not hang quite as planned; this casts rays",
        default=False,
    )
    rules: CollectionProperty(type=SEIP_PG_position_rule)
    active_rule: IntProperty(name="Position")
    position: StringProperty(
        name="Position",
        description="Name of a position, as laid out: type to search",
        search=pointing.search_positions,
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
            budget=_written(self.budget) if self.limit == "BUDGET" else None,
            coverage=_written(self.coverage) / 100 if self.limit == "COVERAGE" else None,
            central_weight=self._weight(),
            min_distance=_written(self.min_distance),
            forbidden=tuple(one.name for one in self.rules if one.rule == "FORBIDDEN"),
            mandatory=tuple(one.name for one in self.rules if one.rule == "MANDATORY"),
        )

    def precaution(self) -> RobustnessSettings | None:
        """Return what the placement is to stand, None where it trusts the map.

        Raises
        ------
        SeipError
            It makes no sense.
        """
        if self.objective == "PLANNED":
            return None
        position, tilt = _written(self.position_error), _written(self.tilt_error)
        risk = Risk(TAILS[self.objective], self.seen_by, self.failure)
        return RobustnessSettings(risk, PoseErrors(position, position, tilt, tilt))

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
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    render: BoolProperty(
        name="Rendered View", description="Render a view of the scene as well, which takes a minute", default=False
    )


def _recolour(_own: object, context: bpy.types.Context) -> None:
    scans.show_cloud(context.scene)


def _follow(_own: object, _context: bpy.types.Context) -> None:
    scans.keep_following()


class SEIP_PG_view(bpy.types.PropertyGroup):
    """How what was found is shown."""

    cloud_colour: EnumProperty(
        name="Point Colours",
        description="What the colours of the point cloud mean",
        items=(
            ("sensor", "Sensor", "Which sensor measured the point"),
            ("intensity", "Intensity", "How strong the return is"),
            ("instance", "Road User", "Which road user returned it"),
        ),
        update=_recolour,
    )
    picture: StringProperty(
        name="Picture",
        description="PNG to write; where one of that name is there already, the next gets a number",
        subtype="FILE_PATH",
        default="//placement.png",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    picture_of: EnumProperty(
        name="View",
        description="What stands beside the plan",
        items=(
            ("VIEW", "This View", "What this viewport shows, with all that is drawn in it and its legend"),
            (
                "RENDER",
                "Rendered",
                "The rendered view that the batch command makes, which takes up to half a minute",
            ),
        ),
    )


class SEIP_PG_traffic(bpy.types.PropertyGroup):
    """Where the traffic comes from, and how it is scanned."""

    file: StringProperty(
        name="Traffic",
        description="Trajectories (.npz) or floating car data of SUMO (.xml, .csv, packed or not); "
        "empty for objects that are animated in the scene",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    routes: StringProperty(
        name="Routes",
        description="SUMO's file with the vehicle types, which knows their sizes",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    net: StringProperty(
        name="Network",
        description="SUMO's .net.xml, which knows the offset from the map",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    loaded: StringProperty(name="Loaded", description="What was found in the file, one fact a line")
    seed: IntProperty(name="Seed", description="Of noise and lost returns", default=0, min=0)
    noise: BoolProperty(
        name="Noise", description="Ranges are noisy and returns get lost, as in the sensors' data sheets", default=True
    )
    rolling_shutter: BoolProperty(
        name="Rolling Shutter", description="Traffic moves while a sensor turns", default=False
    )
    follow: BoolProperty(
        name="Follow the Timeline",
        description="Scan again whenever the frame changes",
        default=False,
        update=_follow,
    )
    whole: BoolProperty(name="All of the Traffic", description="From its first moment to its last", default=True)
    start: FloatProperty(
        name="Start",
        description="Time of the first frame, in seconds",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        min=0.0,
    )
    duration: FloatProperty(
        name="Duration",
        description="To the last frame, in seconds",
        subtype="TIME_ABSOLUTE",
        unit="TIME_ABSOLUTE",
        default=10.0,
        min=0.0,
    )
    rate: FloatProperty(
        name="Rate (Hz)",
        description="Frames a second; at 0 as often as the slowest sensor turns",
        default=0.0,
        min=0.0,
        soft_max=20.0,
        step=100,
    )
    folder: StringProperty(
        name="Folder",
        description="Of the run: its frames and its datasets; a run that was stopped goes on there",
        subtype="DIR_PATH",
        default="//scans",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    formats: EnumProperty(
        name="Formats",
        description="Datasets to write beside the frames",
        items=tuple((key, kind.name, f"Write the dataset as {kind.name}") for key, kind in FORMATS.items()),
        options={"ENUM_FLAG"},
    )
    split: EnumProperty(
        name="Split",
        description="Of the dataset that the run belongs to, whole",
        items=tuple((split, split.capitalize(), f"The run belongs to the split {split!r}") for split in SPLITS),
    )

    def files(self) -> TrafficFiles | None:
        """Return the files that traffic is read from, None where it is animated in the scene."""
        if not self.file:
            return None
        routes = (_path(self.routes),) if self.routes else ()
        return TrafficFiles(_path(self.file), routes, _path(self.net) if self.net else None)

    def recording(self) -> RecordingSettings:
        """Return what is asked of scans, as the core takes it."""
        return RecordingSettings(
            scan=ScanSettings(self.seed, self.noise, self.rolling_shutter, self.id_data.seip.survey.engine),
            start=None if self.whole else _written(self.start),
            duration=None if self.whole else _written(self.duration),
            rate=_written(self.rate) or None,
            formats=tuple(key for key in FORMATS if key in self.formats),
            split=self.split,
        )


class SEIP_PG_scene(bpy.types.PropertyGroup):
    """All that SEIP keeps with a scene."""

    version: IntProperty(name="Version", default=state.VERSION, options={"HIDDEN"})
    site: PointerProperty(type=SEIP_PG_site)
    survey: PointerProperty(type=SEIP_PG_survey)
    goal: PointerProperty(type=SEIP_PG_goal)
    result: PointerProperty(type=SEIP_PG_result)
    kept: CollectionProperty(type=SEIP_PG_placement)
    active_kept: IntProperty(name="Kept Placement", description="The one that the present placement is compared with")
    view: PointerProperty(type=SEIP_PG_view)
    traffic: PointerProperty(type=SEIP_PG_traffic)


def _path(text: str) -> Path:
    return Path(bpy.path.abspath(text))


def _written(value: float) -> float:
    """Return the number that a person typed: Blender keeps it in single precision, 0.3 as 0.30000001."""
    return float(f"{value:.7g}")


CLASSES = (
    SEIP_PG_junction,
    SEIP_PG_count,
    SEIP_PG_problem,
    SEIP_PG_site,
    SEIP_PG_sensor_type,
    SEIP_PG_survey,
    SEIP_PG_position_rule,
    SEIP_PG_goal,
    SEIP_PG_chosen,
    SEIP_PG_ranked,
    SEIP_PG_placement,
    SEIP_PG_result,
    SEIP_PG_view,
    SEIP_PG_traffic,
    SEIP_PG_scene,
)


def _weight(thing: bpy.types.Object) -> float:
    value = thing.get(contract.WEIGHT, DEFAULT_WEIGHT)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else DEFAULT_WEIGHT  # the check says what is wrong with it


def _set_weight(thing: bpy.types.Object, value: float) -> None:
    thing[contract.WEIGHT] = _written(value)


_RULES = ("", contract.MANDATORY, contract.FORBIDDEN)


def _rule(thing: bpy.types.Object) -> int:
    return next((number for number, mark in enumerate(_RULES) if mark and thing.get(mark)), 0)


def _set_rule(thing: bpy.types.Object, value: int) -> None:
    for number, mark in enumerate(_RULES[1:], start=1):
        if number == value:
            thing[mark] = True
        elif mark in thing:
            del thing[mark]


def attach() -> None:
    """Give every scene its properties, and objects those that stand for the contract's custom properties."""
    bpy.types.Scene.seip = PointerProperty(type=SEIP_PG_scene)
    bpy.types.Object.seip_region_weight = FloatProperty(
        name="Weight",
        description=f"How much each target in this region counts, where others count 1 ({contract.WEIGHT})",
        get=_weight,
        set=_set_weight,
        min=0.001,
        soft_max=10.0,
        options=set(),
    )
    bpy.types.Object.seip_pole_rule = EnumProperty(
        name="Rule",
        description=f"What the placement does with this pole ({contract.FORBIDDEN}, {contract.MANDATORY})",
        items=(
            ("FREE", "Free", "It may carry a sensor"),
            ("MANDATORY", "Sensor", "It must carry one"),
            ("FORBIDDEN", "No Sensor", "It must carry none"),
        ),
        get=_rule,
        set=_set_rule,
        options=set(),
    )


def detach() -> None:
    """Take them away."""
    del bpy.types.Object.seip_pole_rule
    del bpy.types.Object.seip_region_weight
    del bpy.types.Scene.seip
