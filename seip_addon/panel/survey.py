"""The survey of a scene: its settings, and jobs that compute its layout, visibility grid and placement.

Each job is a generator that may run in a thread: it touches neither Blender's data nor the session, and returns a
`SceneState`, which the operator keeps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterable
from dataclasses import replace

import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, StringProperty

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.search_limits import DEFAULT_EFFORT
from ..core.output.results.placement_record import PlacementRecord, RecordedSettings, parsed_record
from ..core.sensing.visibility.settings import VisibilitySettings
from ..core.sensing.weather import Weather
from ..core.site.candidates import DEFAULT_TYPE, MAX_SENSOR_HEIGHT, CandidateSettings, heights_of, tilts_of
from ..core.site.installed_cost import InstalledCost, load_installed_cost
from ..core.site.post_rules import ALLOWED, ASSUMED_POLES, RULES
from ..core.storage.files import check_folder
from ..core.workflows.records import inputs_of, restored_solution
from ..core.workflows.survey import Survey, lay_out, see
from ..core.workflows.survey_settings import SurveySettings
from ..scene.changes import watch
from ..scene.read import SceneReading, read_scene
from . import preferences
from .layout import draw_path, draw_settings
from .preferences import catalogue_files
from .properties import absolute, as_typed, complaint, of_setting
from .scene_status import same_grid
from .session import SceneState, session

_CANDIDATES = CandidateSettings()


def _listed(numbers: Iterable[float]) -> str:
    """Return numbers as a user would type them."""
    return " ".join(f"{number:.7g}" for number in numbers)


class SEIP_PG_sensor_type(bpy.types.PropertyGroup):
    """A type of sensor that may be chosen; its name is its key in the catalogue."""

    use: BoolProperty(name="Use", description="Let the placement choose sensors of this type", default=True)


class SEIP_PG_survey(bpy.types.PropertyGroup):
    """Layout of the site and the visibility of its targets."""

    types: CollectionProperty(type=SEIP_PG_sensor_type)
    about: StringProperty(name="Sensor", description="Catalogue key of the sensor whose figures and beams are shown")
    filter: StringProperty(
        name="Filter",
        description="Part of a manufacturer's or product's name",
        options={"SKIP_SAVE", "TEXTEDIT_UPDATE"},
    )
    preview_height: FloatProperty(
        name="Height",
        description="Height of the previewed sensor above the 3D cursor",
        unit="LENGTH",
        default=5.4,
        min=0.1,
        max=MAX_SENSOR_HEIGHT,
        soft_max=20.0,
        step=10,
    )
    heights: StringProperty(
        name="Heights (m)",
        description="Mounting heights above the ground in metres, like 3.5 5.4 8, or a range FROM:TO:STEP",
        default=_listed(_CANDIDATES.heights),
    )
    tilts: StringProperty(
        name="Tilts (°)",
        description="Tilts of the sensors down towards the region, in degrees, like 0 5 10, or a range "
        "FROM:TO:STEP; 0 is upright, a negative tilt points up",
        default=_listed(map(math.degrees, _CANDIDATES.tilts)),
    )
    grid: of_setting(SurveySettings, "grid_spacing", "Point Spacing", min=0.05, soft_max=10.0, step=10)
    delta: of_setting(VisibilitySettings, "delta", "Ray Within (δ)", min=0.01, soft_max=5.0, step=10)
    rain: of_setting(Weather, "rain", "Rain (mm/h)", max=500.0, soft_max=50.0)
    fog: BoolProperty(name="Fog", description="Reduced visibility in fog or snow")
    visibility: of_setting(Weather, "visibility", "Visibility", default=200.0, soft_max=2000.0)
    wet_road: of_setting(Weather, "wet_road", "Wet Road")
    spacing: of_setting(CandidateSettings, "spacing", "Post Spacing", soft_max=50.0, step=50)
    allow: of_setting(
        CandidateSettings,
        "allow",
        "Allow",
        items=[
            *((name, rule.title, f"Positions {rule.reason}") for name, rule in RULES.items()),
            (ASSUMED_POLES, "Assumed poles", "Poles of traffic lights for which the map has no post"),
        ],
    )
    installed: BoolProperty(name="Installed Cost", description="Include posts, power and backhaul in prices")
    installed_cost: of_setting(
        SurveySettings,
        "installed_cost",
        "Cost Table",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    effort: FloatProperty(
        name="Search Time",
        description=(
            "Limit of the search: seconds of one processor core, counted as work, so that the same inputs give the "
            "same placement on every machine"
        ),
        unit="TIME_ABSOLUTE",
        default=DEFAULT_EFFORT,
        min=0.1,
        soft_max=3600.0,
    )

    def used_types(self) -> list[str]:
        """Return the catalogue keys of the types to choose from; the default type where none was ever listed."""
        return [one.name for one in self.types if one.use] if len(self.types) else [DEFAULT_TYPE]

    def shown_type(self) -> str:
        """Return the key of the type whose figures and beams are shown, or ""."""
        used = self.used_types()
        return self.about if self.about in used else next(iter(used), "")

    def parsed_heights(self) -> list[float]:
        """Return the mounting heights in metres; none where the text is wrong."""
        return [] if self.wrong_heights() else list(heights_of(self.heights.split()))

    def wrong_heights(self) -> str:
        """Say what is wrong with the heights, or nothing."""
        return complaint(lambda: CandidateSettings(heights=heights_of(self.heights.split())))

    def wrong_tilts(self) -> str:
        """Say what is wrong with the tilts, or nothing."""
        return complaint(lambda: CandidateSettings(tilts=tilts_of(self.tilts.split())))

    def weather(self) -> Weather:
        """Return the weather that sensors look through."""
        return Weather(as_typed(self.rain), as_typed(self.visibility) if self.fog else math.inf, self.wet_road)

    def settings(self) -> SurveySettings:
        """Return the settings as the core takes them.

        Raises
        ------
        SeipError
            It makes no sense.
        """
        return SurveySettings(
            candidates=CandidateSettings(
                sensors=tuple(self.used_types()),
                heights=heights_of(self.heights.split()),
                tilts=tilts_of(self.tilts.split()),
                spacing=as_typed(self.spacing),
                allow=tuple(name for name in ALLOWED if name in self.allow),
            ),
            visibility=VisibilitySettings(as_typed(self.delta)),
            weather=self.weather(),
            grid_spacing=as_typed(self.grid),
            catalogue=catalogue_files(),
            installed_cost=self._installed_cost(),
            effort=as_typed(self.effort),
        )

    def take_over(self, request: RecordedSettings) -> None:
        """Take over the settings of a placement, as far as the panel has them."""
        candidates, weather = request.candidates, request.weather
        for key in candidates.sensors:
            if key not in self.types:
                self.types.add().name = key
        for one in self.types:
            one.use = one.name in candidates.sensors
        self.heights = _listed(candidates.heights)
        self.tilts = _listed(map(math.degrees, candidates.tilts))
        self.spacing, self.allow = candidates.spacing, set(candidates.allow)
        self.grid, self.delta = request.grid_spacing_m, request.visibility.delta
        self.rain, self.wet_road = weather.rain, weather.wet_road
        self.fog = math.isfinite(weather.visibility)
        if self.fog:
            self.visibility = weather.visibility
        self.installed, self.effort = request.installed_cost is not None, request.effort

    def _installed_cost(self) -> InstalledCost | None:
        if not self.installed:
            return None
        return load_installed_cost(absolute(self.installed_cost) if self.installed_cost else None)


def read_layout(scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
    """Return a job that lays out a scene with the panel's settings; the scene is read at once, if it has changed.

    Raises
    ------
    SeipError
        The scene lacks something, or a setting of the panel is invalid.
    """
    began = time.perf_counter()
    settings = scene.seip.survey.settings()
    settings.models()  # refuses before the scene is read
    catalogues = tuple((path, path.stat().st_mtime_ns) for path in settings.catalogue)
    cache = preferences.cache_folder()
    state, known = session.of(scene).state, None
    if state is not None and not state.watch.look(scene) and state.catalogues == catalogues:
        if same_grid(settings, state.layout.settings):
            layout = replace(state.layout, settings=settings)
            known = replace(state, layout=layout, grid_file=cache / state.grid_file.name)
        reading, watching = SceneReading(state.layout.geometry, state.warnings), state.watch
    else:
        watching, reading = watch(scene), read_scene(scene)
    seconds = time.perf_counter() - began

    def steps() -> Generator[Progress, None, SceneState]:
        if known is not None:
            return known
        yield Progress(0, 0, "laying out the site")
        began = time.perf_counter()
        layout = lay_out(reading.geometry, settings, reading.warnings)
        durations = {"read the scene": seconds, "lay out the site": time.perf_counter() - began}
        inputs = inputs_of(layout)
        file = cache / f"{inputs['visibility'][:32]}.npz"
        return SceneState(layout, inputs, watching, file, catalogues, reading.warnings, durations=durations)

    return steps()


def with_visibility(state: SceneState) -> Generator[Progress, None, tuple[SceneState, Survey]]:
    """Compute the visibility grid of a survey, or take it from the cache; return the state and the survey."""
    if state.survey is not None:
        return state, state.survey
    began = time.perf_counter()
    try:
        check_folder(state.grid_file.parent)
    except SeipError as error:
        raise SeipError(f"{error} as Cache in the add-on's preferences") from error
    survey = yield from see(state.layout, state.grid_file)
    return replace(state, layout=survey, durations=state.timed("visibility", began)), survey


def with_placement(scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
    """Return a job that restores a scene's placement from the record in the file and the cached grid.

    Raises
    ------
    SeipError
        There is no placement. When the work runs: the scene or its settings are not what they were, or the cache is
        empty.
    """
    text = scene.seip.result.record
    if not text:
        raise SeipError("there is no placement yet: place sensors first")
    return _restored(read_layout(scene), text)


def with_grid_of(
    surveying: Generator[Progress, None, SceneState], record: PlacementRecord
) -> Generator[Progress, None, tuple[SceneState, Survey]]:
    """Do the work of `survey`, and restore the cached grid of a placement; raises as that of `with_placement` does."""
    state = yield from surveying
    if not record.is_of(state.inputs):
        raise SeipError("the scene or its settings have changed since the placement: place again")
    if state.survey is None and not state.grid_file.exists():
        raise SeipError("the cache no longer holds the visibility of this placement: place again")
    return (yield from with_visibility(state))


def _restored(surveying: Generator[Progress, None, SceneState], text: str) -> Generator[Progress, None, SceneState]:
    record = parsed_record(text)
    state, survey = yield from with_grid_of(surveying, record)
    if state.record == text and state.solution is not None:
        return state
    solution = yield from restored_solution(survey, record)
    return replace(state, solution=solution, record=text)


def draw_candidates(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw how the site is laid out and how rays are cast."""
    survey = scene.seip.survey
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


def draw_search(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the limit of the search."""
    draw_settings(layout, scene.seip.survey, "effort")
