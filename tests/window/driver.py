"""Blender's window, driven by mouse and keyboard from within: what a script for a person to watch would do.

Blender must run with ``--enable-event-simulate``. A scenario is a generator that
yields seconds to wait; buttons are found by what they do, wherever they are: the
mouse goes down the sidebar and asks of each place which operator or property is
there.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
import traceback
import unicodedata
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy
import numpy as np

Steps = Generator[float, None, None]

ROW = 10
"""Pixels between two places that are asked: buttons are 20 high."""
EDGE, STEP, STOP = 24, 6, 16
"""Pixels from the sidebar's edge to its buttons, between two places of a row, and from a Stop button to its bar."""
BLUE = 40
"""How much more blue than red a bar's filled part is."""
BEAT = 0.04
"""Seconds that Blender has to notice an event."""
NAMES = {digit: unicodedata.name(digit).removeprefix("DIGIT ") for digit in "0123456789"}
NAMES |= {".": "PERIOD", ":": "SEMI_COLON", "-": "MINUS", "/": "SLASH", " ": "SPACE"}
FULL = {"full_path": True}


class Window:
    """The first window with its 3D viewport.

    Parameters
    ----------
    pictures : Path
        Folder for pictures.
    """

    def __init__(self, pictures: Path) -> None:
        self.pictures = pictures

    @property
    def window(self) -> bpy.types.Window:
        """Blender's window."""
        return bpy.context.window_manager.windows[0]

    @property
    def area(self) -> bpy.types.Area:
        """The 3D viewport."""
        return max((a for a in self.window.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width * a.height)

    def region(self, kind: str) -> bpy.types.Region:
        """Return a region of the viewport: UI is the sidebar."""
        return next(region for region in self.area.regions if region.type == kind)

    def event(self, kind: str, value: str, place: tuple[int, int], **more: object) -> None:
        """Simulate one event."""
        self.window.event_simulate(type=kind, value=value, x=place[0], y=place[1], **more)

    def open_sidebar(self, tab: str) -> Steps:
        """Show the sidebar with a tab in front."""
        bpy.context.preferences.view.show_splash = False
        self.area.spaces.active.show_region_ui = True
        self.area.tag_redraw()
        yield 0.7  # tabs exist once they have been drawn
        self.region("UI").active_panel_category = tab
        self.area.tag_redraw()
        yield 0.7

    def press(self, key: str, place: tuple[int, int] | None = None, **held: bool) -> Steps:
        """Press and let go of a key or button of the mouse, with shift, ctrl or alt held."""
        where = place or self.middle
        yield from self._hover(where, 2 * BEAT)  # a button takes no click before the mouse has moved onto it
        for value in ("PRESS", "RELEASE"):
            self.event(key, value, where, **held)
            yield BEAT

    @property
    def middle(self) -> tuple[int, int]:
        """The middle of the viewport."""
        region = self.region("WINDOW")
        return region.x + region.width // 2, region.y + region.height // 2

    def find(self, what: str) -> Generator[float, None, tuple[int, int]]:
        """Scroll the sidebar until a button is seen, and return its place.

        Parameters
        ----------
        what : str
            Part of an operator's call or of a property's path: ``seip.solve_placement(``, ``seip.goal.count``.
        """
        for columns in ((0.6,), (0.85, 0.2)):  # of the width: most rows hold one button, some several
            for start in ("as it is", "top"):
                if start == "top":
                    yield from self._scroll(-20)
                scrolled = True
                while scrolled:
                    place = yield from self._find_here(what, columns)
                    if place:
                        return place
                    before = self._height
                    yield from self._scroll(1)
                    scrolled = self._height != before
        raise LookupError(f"there is no button {what} in the sidebar")

    @property
    def _height(self) -> float:
        """How far the sidebar is scrolled."""
        return float(self.region("UI").view2d.region_to_view(0, 0)[1])

    def _find_here(self, what: str, columns: Sequence[float]) -> Generator[float, None, tuple[int, int] | None]:
        region = self.region("UI")
        for y in range(region.y + region.height - 4, region.y, -ROW):
            for share in columns:
                place = (region.x + int(share * (region.width - 24)), y)
                yield from self._hover(place, BEAT / 2)
                if what in self._asked():
                    yield from self._hover(place, 10 * BEAT)  # it may have been slow to notice the mouse
                    if what in self._asked():
                        return place
        return None

    def _hover(self, place: tuple[int, int], seconds: float) -> Steps:
        self.event("MOUSEMOVE", "NOTHING", place)
        yield seconds

    def click(self, what: str) -> Steps:
        """Click a button of the sidebar."""
        place = yield from self.find(what)
        yield from self.press("LEFTMOUSE", place)
        yield 0.2

    def click_in_view(self, what: str) -> Steps:
        """Click a button that is in view without scrolling."""
        for columns in ((0.6,), (0.85, 0.2)):
            place = yield from self._find_here(what, columns)
            if place:
                yield from self.press("LEFTMOUSE", place)
                yield 0.2
                return
        raise LookupError(f"there is no button {what} in view")

    def shot(self, name: str) -> Steps:
        """Save what the window shows without moving the mouse: a dialog closes when it leaves."""
        from PIL import Image  # noqa: PLC0415  # comes with the extension

        self.pictures.mkdir(parents=True, exist_ok=True)
        Image.fromarray(self.pixels()).save(self.pictures / f"{name}.png", optimize=True)
        yield 0.1

    def open_section(self, name: str) -> Steps:
        """Open a section of the sidebar; a header is not a button that the mouse could be asked for."""
        setattr(bpy.context.window_manager.seip_sections, name, True)
        self.area.tag_redraw()
        yield 0.5

    def beside(self, place: tuple[int, int], what: str) -> Generator[float, None, tuple[int, int]]:
        """Return the place of a button in the row of a place, or next to that row, from the right."""
        region = self.region("UI")
        for y in (place[1], place[1] - ROW, place[1] + ROW):
            for x in range(region.x + region.width - EDGE, region.x, -STEP):
                yield from self._hover((x, y), BEAT / 2)
                if what in self._asked():
                    yield from self._hover((x, y), 10 * BEAT)
                    if what in self._asked():
                        return x, y
        raise LookupError(f"there is no button {what} beside {place}")

    def pixels(self) -> Any:
        """Return what the window shows, (height, width, 3) uint8, from the top."""
        from PIL import Image  # noqa: PLC0415  # comes with the extension

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "window.png"
            # ImageMagick's, of the screen: Blender's own pictures are black where OpenGL is drawn in software
            subprocess.run(["import", "-window", "root", str(path)], check=True)  # noqa: S603, S607
            with Image.open(path) as shot:
                return np.asarray(shot.convert("RGB"))

    def filled(self, stop: tuple[int, int]) -> float:
        """Return which share of a progress bar is filled, as it is drawn left of its Stop button."""
        region, pixels = self.region("UI"), self.pixels()
        row = pixels[len(pixels) - 1 - stop[1], region.x + EDGE // 2 : stop[0] - STOP].astype(int)
        return float(np.mean(row[:, 2] - row[:, 0] > BLUE))

    def enter(self, what: str, text: str) -> Steps:
        """Type into a field of the sidebar, in place of what is there."""
        place = yield from self.find(what)
        yield from self.press("RET", place)
        yield from self.press("A", place, ctrl=True)
        yield from self.type(text, place)
        yield from self.press("RET", place)
        yield 0.2

    def type(self, text: str, place: tuple[int, int] | None = None) -> Steps:
        """Press the keys of a text one after the other."""
        where = place or self.middle
        for letter in text:
            key = NAMES.get(letter, letter.upper())
            self.event(key, "PRESS", where, unicode=letter)
            yield BEAT
            self.event(key, "RELEASE", where)
            yield BEAT

    def until(self, holds: Callable[[], object], seconds: float) -> Steps:
        """Wait until something holds."""
        end = time.monotonic() + seconds
        while not holds():
            if time.monotonic() > end:
                raise TimeoutError(f"not within {seconds:g} s")
            yield 0.1

    def picture(self, name: str) -> Steps:
        """Save what the window shows."""
        self.event("MOUSEMOVE", "NOTHING", self.middle)  # no tooltip, no button lit
        self.area.tag_redraw()
        yield 1.0
        yield from self.shot(name)

    def _scroll(self, pages: int) -> Steps:
        """Scroll the sidebar: not by the wheel, which scrolls a list where the mouse is over one."""
        way = bpy.ops.view2d.scroll_down if pages > 0 else bpy.ops.view2d.scroll_up
        with bpy.context.temp_override(window=self.window, area=self.area, region=self.region("UI")):
            for _ in range(abs(pages)):
                way(page=True)
        yield 0.3

    def _asked(self) -> str:
        """Return what the button under the mouse does."""
        manager = bpy.context.window_manager
        manager.clipboard = ""
        with bpy.context.temp_override(window=self.window, area=self.area, region=self.region("UI")):
            for ask, more in ((bpy.ops.ui.copy_python_command_button, {}), (bpy.ops.ui.copy_data_path_button, FULL)):
                with suppress(RuntimeError):  # no such button there
                    ask(**more)
        return str(manager.clipboard)


def play(scenario: Callable[[Window], Iterator[float]], window: Window) -> None:
    """Play a scenario once Blender's window is up, and end Blender: status 0, or 1 with the fault on standard error."""
    steps = scenario(window)

    def tick() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            _leave(0)
        except Exception:  # noqa: BLE001  # whatever it is, the window must close
            traceback.print_exc()
            subprocess.run(["import", "-window", "root", str(window.pictures / "fault.png")], check=False)  # noqa: S603, S607
            _leave(1)
        return None

    bpy.app.timers.register(tick, first_interval=2.0, persistent=True)


def _leave(status: int) -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # asks nothing about unsaved changes
