"""Background jobs that read a scene and compute its layout, visibility grid and placement.

Each public function returns a generator that may run in a thread: it touches
neither Blender's data nor the session, and returns a `SceneState`, which the
operator keeps.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import replace

import bpy

from .. import preferences
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.output.results.placement_record import PlacementRecord, parsed_record
from ..core.storage.files import check_folder
from ..core.workflows.records import inputs_of, restored_solution
from ..core.workflows.survey import Survey, lay_out, see
from ..scene import changes
from ..scene.changes import watch
from ..scene.read import SceneReading, read_scene
from ..state.scene_status import FILE_VERSION, obstacle, same_grid
from ..state.session import SceneState, session
from ..viewport import overlays

LOAD_DELAY = 0.2
"""Seconds from the opening of a file to the work on it."""


def survey(scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
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
    cache, cores = preferences.cache_folder(), preferences.cores()
    state = session.of(scene).state
    if state is not None and not state.watch.look(scene) and state.catalogues == catalogues:
        if same_grid(settings, state.layout.settings):
            layout = replace(state.layout, settings=settings)
            return _nothing_to_do(replace(state, layout=layout, grid_file=cache / state.grid_file.name, cores=cores))
        reading, watching = SceneReading(state.layout.geometry, state.warnings), state.watch
    else:
        watching, reading = watch(scene), read_scene(scene)
    seconds = time.perf_counter() - began

    def steps() -> Generator[Progress, None, SceneState]:
        yield Progress(0, 0, "laying out the site")
        began = time.perf_counter()
        layout = lay_out(reading.geometry, settings, reading.warnings)
        durations = {"read the scene": seconds, "lay out the site": time.perf_counter() - began}
        inputs = inputs_of(layout)
        file = cache / f"{inputs['visibility'][:32]}.npz"
        return SceneState(layout, inputs, watching, file, cores, catalogues, reading.warnings, durations=durations)

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
    survey = yield from see(state.layout, state.grid_file, threads=state.cores)
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
    return _restored(survey(scene), text)


def _nothing_to_do(state: SceneState) -> Generator[Progress, None, SceneState]:
    yield from ()
    return state


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


def _after_load(*_: object) -> None:
    """Compare the placement of the file with its scene, soon: Blender is not ready for work yet."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_compare):
        bpy.app.timers.register(_compare, first_interval=LOAD_DELAY)


def _compare() -> None:
    """Compare each window's scene with its placement, one: there is one piece of work at a time."""
    for window in bpy.context.window_manager.windows:
        scene = window.scene
        unknown = session.of(scene).state is None and scene.seip.result.record
        if session.running is None and unknown and not obstacle(scene):
            with (
                bpy.context.temp_override(window=window),
                suppress(RuntimeError),
            ):  # the panel says that nothing is known
                bpy.ops.seip.compare_scene("INVOKE_DEFAULT")
            return


def _before_save(*_: object) -> None:
    """Store the version of the properties' layout in the file: Blender saves no defaults."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.seip.version <= FILE_VERSION and scene.is_property_set("seip"):
            scene.seip.version = FILE_VERSION


def _after_undo(*_: object) -> None:
    """Look soon whether scenes are as they were when they were read: Blender is not ready for work yet."""
    if not bpy.app.timers.is_registered(look_again):
        bpy.app.timers.register(look_again, first_interval=0.0)


def look_again() -> None:
    """Look whether scenes are as they were when they were read, and draw that in the panel."""
    for scene in bpy.data.scenes:
        changes.look_again(scene)
    overlays.redraw()


HANDLERS = (
    ("load_post", _after_load),
    ("save_pre", _before_save),
    ("depsgraph_update_post", changes.on_update),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)


AT_START = (_after_load,)
TIMERS = (_compare, look_again)
