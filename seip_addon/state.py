"""What the add-on holds in memory: surveys by scene, and the work that is under way.

None of it is needed to go on: the file keeps what was asked and found, and the
cache keeps visibility. Scenes are named by their session number, as undo and
redo put another Python object in place of each.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import bpy

from .core.errors import SeipError
from .core.goal import Plan
from .core.progress import Progress
from .core.survey import Layout, lay_out
from .core.visibility.grid import VisibilityGrid
from .scene.read import read_scene


@dataclass
class Held:
    """What is known of a scene.

    Parameters
    ----------
    layout : Layout
        As the scene was when it was last read.
    grid : VisibilityGrid or None
        Of that layout.
    plan : Plan or None
        Of that grid, where it was made since the file was opened.
    durations : dict of str to float, seconds
        How long each step took.
    """

    layout: Layout
    grid: VisibilityGrid | None = None
    plan: Plan | None = None
    durations: dict[str, float] = field(default_factory=dict)


@dataclass
class Running:
    """Work that is under way.

    Parameters
    ----------
    operator : str
        Its ``bl_idname``.
    progress : Progress
    began : float
        Reading of `time.monotonic`.
    stop : bool
        Whether somebody asked to stop it.
    """

    operator: str
    progress: Progress
    began: float = field(default_factory=time.monotonic)
    stop: bool = False


held: dict[int, Held] = {}
"""By the scene's session number."""

running: Running | None = None


def find(scene: bpy.types.Scene) -> Held | None:
    """Return what is known of a scene, or None."""
    return held.get(scene.session_uid)


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


def read(scene: bpy.types.Scene) -> Held:
    """Read and lay out a scene as its panel asks, and hold that in place of what was held.

    Raises
    ------
    SeipError
        The scene lacks something, or the panel asks for what makes no sense.
    """
    began = time.perf_counter()
    reading = read_scene(scene)
    layout = lay_out(reading.geometry, scene.seip.survey.settings(), reading.warnings)
    held[scene.session_uid] = Held(layout, durations={"read the scene": time.perf_counter() - began})
    return held[scene.session_uid]


def forget() -> None:
    """Let go of everything: another file is about to be opened."""
    global running  # noqa: PLW0603  # there is one Blender, and one piece of work at a time
    held.clear()
    if running is not None:
        running.stop = True
    running = None


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _before_load(*_: object) -> None:
    forget()


CLASSES: tuple[type, ...] = ()


def attach() -> None:
    """Let go of everything whenever another file is opened."""
    bpy.app.handlers.load_pre.append(_before_load)


def detach() -> None:
    """Let go of everything."""
    bpy.app.handlers.load_pre.remove(_before_load)
    forget()
