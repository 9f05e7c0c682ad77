"""In-memory state of the add-on: surveys by scene, and running work.

None of it is needed to go on: the file keeps what was asked and found, and the
cache keeps visibility. Scenes are named by their session number, as undo and
redo put another Python object in place of each.
"""

from __future__ import annotations

import json
import time
from collections.abc import Generator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import bpy

from . import preferences
from .background import Background
from .core.errors import SeipError
from .core.placement.objective import MOVED, Solution
from .core.progress import Progress
from .core.results.placement_record import Record
from .core.storage.files import check_folder
from .core.visibility.estimate import Estimate
from .core.visibility.grid import VisibilityGrid
from .core.workflows.by_hand import restored_by_hand
from .core.workflows.survey import Layout, SurveySettings, inputs_of, lay_out, restored_plan, see
from .scene import contract
from .scene.changes import Watch, on_update, watch
from .scene.read import SceneReading, read_scene

SOON = 0.2
"""Seconds from the opening of a file to the work on it."""

VERSION = 1
"""Of what the add-on keeps with a scene: a file with a higher one was saved by a newer add-on."""


@dataclass(frozen=True)
class Means:
    """What the preferences give to work, which must not ask Blender itself once it is in a thread.

    Parameters
    ----------
    cache : Path
        Folder in which visibility is kept.
    cores : int or None
        Threads that may compute it, or None where nobody has said.
    """

    cache: Path
    cores: int | None

    def grid_file(self, key: str) -> Path:
        """Return where the cache keeps a visibility grid."""
        return self.cache / f"{key[:32]}.npz"

    def check(self) -> None:
        """See that visibility can be kept, and say where the folder is set if it cannot.

        Raises
        ------
        SeipError
            The folder cannot be written.
        """
        try:
            check_folder(self.cache)
        except SeipError as error:
            raise SeipError(f"{error} as Cache in the add-on's preferences") from error


@dataclass(frozen=True)
class Held:
    """What is known of a scene; `hold` has one take the place of another.

    Parameters
    ----------
    layout : Layout
        As the scene was when it was last read.
    inputs : mapping of str to str
        Digests of what a placement on that layout follows from; see `inputs_of`.
    watch : Watch
        Whether the scene has changed since.
    means : Means
        As the preferences were when this was asked for last.
    catalogues : tuple
        The user's catalogue files and when each was last written.
    said : tuple of str
        Warnings of the scene's reading.
    grid : VisibilityGrid or None
        Of that layout.
    estimate : Estimate or None
        Of what the grid will take.
    plan : Solution or None
        Of that grid: the one that the scene's result tells of.
    record : str
        The result that the plan was taken from.
    durations : mapping of str to float, seconds
        How long each step took.
    """

    layout: Layout
    inputs: Mapping[str, str]
    watch: Watch
    means: Means
    catalogues: tuple[tuple[Path, int], ...]
    said: tuple[str, ...] = ()
    grid: VisibilityGrid | None = None
    estimate: Estimate | None = None
    plan: Solution | None = None
    record: str = ""
    durations: Mapping[str, float] = field(default_factory=dict)

    def timed(self, step: str, began: float) -> dict[str, float]:
        """Return the durations with that of a step that began at a reading of `time.perf_counter`."""
        return {**self.durations, step: time.perf_counter() - began}


@dataclass
class Running:
    """Work that is under way.

    Parameters
    ----------
    operator : str
        Its ``bl_idname``.
    began : float
        Reading of `time.monotonic`.
    timer : bpy.types.Timer or None
        Has somebody look at it from time to time.
    stop : bool
        Whether somebody asked to stop it.
    """

    operator: str
    work: Background[Any]
    began: float = field(default_factory=time.monotonic)
    timer: bpy.types.Timer | None = None
    stop: bool = False


@dataclass(frozen=True)
class Check:
    """What a check of a site was made on.

    Parameters
    ----------
    watch : Watch
        Whether the scene has changed since.
    settings : SurveySettings or str
        See `checked_settings`.
    """

    watch: Watch
    settings: SurveySettings | str


held: dict[int, Held] = {}
"""By the scene's session number."""
checked: dict[int, Check] = {}
"""As above."""

running: Running | None = None


def find(scene: bpy.types.Scene) -> Held | None:
    """Return what is known of a scene, or None."""
    return held.get(scene.session_uid)


def hold(scene: bpy.types.Scene, known: Held) -> None:
    """Hold what some work has found of a scene, in place of what was known: for the main thread, once it has ended."""
    held[scene.session_uid] = known


def scene_of(number: int) -> bpy.types.Scene:
    """Return the scene with a session number.

    Raises
    ------
    SeipError
        It was deleted.
    """
    for scene in bpy.data.scenes:
        if scene.session_uid == number:
            return scene
    raise SeipError("the scene that this was computed for is gone: nothing was written")


NEWER = "This file was saved by a newer version of SEIP: install that version to go on."
LINKED = "This scene is linked from another file: open that file to work on it."


def is_linked(scene: bpy.types.Scene) -> bool:
    """Return whether a scene belongs to another file: nothing can be written into it."""
    return scene.library is not None


def is_newer(scene: bpy.types.Scene) -> bool:
    """Return whether a newer add-on saved the scene: nobody here knows what its record looks like."""
    return bool(scene.seip.version > VERSION)


def obstacle(scene: bpy.types.Scene) -> str:
    """Return why nothing can be computed for a scene, in a sentence for panels and buttons alike; empty if it can."""
    if is_linked(scene):
        return LINKED
    if is_newer(scene):
        return NEWER
    for name, what in ((contract.REGION, "region"), (contract.ROADS, "road")):
        if not contract.has_members(scene, name):
            return f"There is no {what}: put a mesh into the collection {name!r}."
    return ""


def doubt(scene: bpy.types.Scene) -> str:
    """Return why what is held does not tell of the scene as it is, in a sentence; empty if it does."""
    known = find(scene)
    if known is None:
        return ""
    if known.watch.changed:
        return "The scene has changed since it was computed."
    try:
        same = _same_grid(scene.seip.survey.settings(), known.layout.settings)
    except SeipError as error:
        return str(error)
    return "" if same else "The settings have changed since it was computed."


NOT_COMPARED = "Not compared with the scene since the file was opened."
ANOTHER_SITE = "The scene or its settings have changed since this placement: place again."
OLD_CHECK = "Checked before the file was opened: check again."


def doubt_of_placement(scene: bpy.types.Scene) -> str:
    """Return why the scene's placement does not tell of the scene as it is, in a sentence; empty if it does."""
    known = find(scene)
    if known is None:
        return NOT_COMPARED
    return doubt(scene) or ("" if _is_of(record_of(scene.seip.result.record), known) else ANOTHER_SITE)


def doubt_of_check(scene: bpy.types.Scene) -> str:
    """Return why the scene's check does not tell of the scene as it is, in a sentence; empty if it does."""
    check = checked.get(scene.session_uid)
    if check is None:
        return OLD_CHECK
    if check.watch.changed:
        return "The scene has changed since the check."
    return "" if check.settings == checked_settings(scene) else "The settings have changed since the check."


def checked_settings(scene: bpy.types.Scene) -> SurveySettings | str:
    """Return the settings that a check of a scene tells of, or what is wrong with them."""
    try:
        return _without_search(scene.seip.survey.settings())
    except SeipError as error:
        return str(error)


def survey(scene: bpy.types.Scene) -> Generator[Progress, None, Held]:
    """Return the work that lays out a scene as its panel asks; the scene is read at once, if it must be read at all.

    Raises
    ------
    SeipError
        The scene lacks something, or the panel asks for what makes no sense.
    """
    settings = scene.seip.survey.settings()
    settings.models()  # refuses before the scene is read
    catalogues = tuple((path, path.stat().st_mtime_ns) for path in settings.catalogue)
    means = Means(preferences.cache_folder(), preferences.cores())
    known = find(scene)
    if known is not None and not known.watch.look(scene) and known.catalogues == catalogues:
        if _same_grid(settings, known.layout.settings):
            layout = replace(known.layout, settings=settings)
            return _nothing_to_do(replace(known, layout=layout, means=means))
        reading = SceneReading(known.layout.geometry, known.said)
        return _laid_out(reading, settings, known.watch, means, catalogues)
    began = time.perf_counter()
    watching = watch(scene)
    reading = read_scene(scene)
    return _laid_out(reading, settings, watching, means, catalogues, time.perf_counter() - began)


def seen(known: Held) -> Generator[Progress, None, tuple[Held, VisibilityGrid]]:
    """Find who sees what in a scene that was laid out, or take it from the cache; return all, and that alone."""
    if known.grid is not None:
        return known, known.grid
    began = time.perf_counter()
    known.means.check()
    file = known.means.grid_file(known.inputs["visibility"])
    grid = yield from see(known.layout, file, threads=known.means.cores)
    return replace(known, grid=grid, durations=known.timed("visibility", began)), grid


def answered(scene: bpy.types.Scene) -> Generator[Progress, None, Held]:
    """Return the work that finds all about a scene's placement again, from what the file and the cache keep.

    Raises
    ------
    SeipError
        There is no placement. When the work runs: the scene or its settings are not what they were, or the cache is
        empty.
    """
    text = scene.seip.result.record
    if not text:
        raise SeipError("there is no placement yet: place sensors first")
    return _answered(survey(scene), text)


def seen_again(scene: bpy.types.Scene) -> Generator[Progress, None, tuple[Held, VisibilityGrid]]:
    """Return the work that finds again what a scene's placement was chosen from; raises as `answered` does."""
    return _seen_again(survey(scene), record_of(scene.seip.result.record))


def forget() -> None:
    """Let go of everything: another file is about to be opened."""
    global running  # noqa: PLW0603  # there is one Blender, and one piece of work at a time
    held.clear()
    checked.clear()
    if running is not None:
        running.stop = True
        running.work.stop()
    running = None


@lru_cache(maxsize=8)
def record_of(text: str) -> Record:
    """Return the record that a scene keeps as a text; panels ask for it at every redraw."""
    record: Record = json.loads(text)
    return record


def _same_grid(one: SurveySettings, other: SurveySettings) -> bool:
    """Return whether settings differ in how a placement is searched at most."""
    return _without_search(one) == _without_search(other)


def _without_search(settings: SurveySettings) -> SurveySettings:
    default = SurveySettings()
    return replace(settings, solver=default.solver, time_limit=default.time_limit, effort=default.effort)


def _is_of(record: Record, known: Held) -> bool:
    """Return whether a record's placement was made on what is known; an older record holds fewer digests."""
    return all(known.inputs.get(name) == key for name, key in record["inputs"].items())


def _nothing_to_do(known: Held) -> Generator[Progress, None, Held]:
    yield from ()
    return known


def _laid_out(
    reading: SceneReading,
    settings: SurveySettings,
    watching: Watch,
    means: Means,
    catalogues: tuple[tuple[Path, int], ...],
    seconds: float = 0.0,
) -> Generator[Progress, None, Held]:
    yield Progress(0, 0, "laying out the site")
    began = time.perf_counter()
    layout = lay_out(reading.geometry, settings, reading.warnings)
    durations = {"read the scene": seconds, "lay out the site": time.perf_counter() - began}
    return Held(layout, inputs_of(layout), watching, means, catalogues, reading.warnings, durations=durations)


def _seen_again(
    surveying: Generator[Progress, None, Held], record: Record
) -> Generator[Progress, None, tuple[Held, VisibilityGrid]]:
    known = yield from surveying
    if not _is_of(record, known):
        raise SeipError("the scene or its settings have changed since the placement: place again")
    if known.grid is None and not known.means.grid_file(known.inputs["visibility"]).exists():
        raise SeipError("the cache no longer holds the visibility of this placement: press Compute Visibility")
    return (yield from seen(known))


def _answered(surveying: Generator[Progress, None, Held], text: str) -> Generator[Progress, None, Held]:
    record = record_of(text)
    known, grid = yield from _seen_again(surveying, record)
    if known.record == text and known.plan is not None:
        return known
    if record["objective"]["status"] == MOVED:
        plan = yield from restored_by_hand(known.layout, grid, record)
    else:
        plan = restored_plan(known.layout, grid, record)
    return replace(known, plan=plan, record=text)


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _before_load(*_: object) -> None:
    forget()


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _after_load(*_: object) -> None:
    """Compare the placement of the file with its scene, soon: Blender is not ready for work yet."""
    if not bpy.app.background and not bpy.app.timers.is_registered(_compare):
        bpy.app.timers.register(_compare, first_interval=SOON)


def _compare() -> None:
    """Compare each window's scene with its placement, one: there is one piece of work at a time."""
    for window in bpy.context.window_manager.windows:
        scene = window.scene
        if running is None and find(scene) is None and scene.seip.result.record and not obstacle(scene):
            with (
                bpy.context.temp_override(window=window),
                suppress(RuntimeError),
            ):  # the panel says that it is not known
                bpy.ops.seip.compare_scene("INVOKE_DEFAULT")
            return


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _before_save(*_: object) -> None:
    """Say in the file by which layout its properties are to be read: Blender saves no defaults."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.seip.version <= VERSION and scene.is_property_set("seip"):
            scene.seip.version = VERSION


HANDLERS = (
    ("load_pre", _before_load),
    ("load_post", _after_load),
    ("save_pre", _before_save),
    ("depsgraph_update_post", on_update),
)

CLASSES: tuple[type, ...] = ()


def attach() -> None:
    """Watch scenes, and let go of everything whenever another file is opened."""
    for event, handler in HANDLERS:
        getattr(bpy.app.handlers, event).append(handler)
    _after_load()


def detach() -> None:
    """Let go of everything."""
    for event, handler in HANDLERS:
        getattr(bpy.app.handlers, event).remove(handler)
    if bpy.app.timers.is_registered(_compare):
        bpy.app.timers.unregister(_compare)
    forget()
