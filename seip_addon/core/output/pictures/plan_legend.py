"""The legend beside a plan: sensors, shares of the road, and what lines and marks mean."""

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

from ...choosing.placement.deployment import Deployment
from ...counts import counted
from ...site.scene_geometry import ASSUMED, FROM_MAP, OTHER_LEVELS, SceneGeometry
from ...site.site import Site
from .coverage_colours import of_placement
from .drawing import MAX_LABELLED, SENSOR_MARK, markers_of, percent
from .palette import FORBIDDEN, INK, MANDATORY, SOFT_INK, WEIGHTED
from .plan_style import (
    ASSUMED_HEIGHT,
    ASSUMED_MARK,
    HEIGHT_CMAP,
    OTHER_ROAD,
    POLE_MARK,
    SIDEWALK_MARK,
    Style,
)

LEGEND_WIDTH, COLUMN_GAP = 3.7, 0.3  # inches, of a column and between two
ROW_HEIGHT, LINE_HEIGHT, SMALL_LINE_HEIGHT = 0.42, 0.24, 0.15  # inches
HEADING_HEIGHT, FOOTNOTE_HEIGHT = 0.36, 0.38  # inches
LETTERS_PER_LINE = 62  # of small text that fit into a line


class PlanLegend:
    """Legend of a plan, written from top to bottom in columns; lengths in inches.

    Parameters
    ----------
    axes : Axes
    height : float, inches
        Height of the axes.
    """

    def __init__(self, axes: Axes, height: float) -> None:
        self.axes = axes
        self.height = height
        self.x, self.y = 0.0, 0.0
        axes.axis("off")

    @property
    def width(self) -> float:
        """Width of the columns that have been written, inches."""
        return self.x + LEGEND_WIDTH

    def draw(
        self, geometry: SceneGeometry, site: Site, deployment: Deployment, heights: Normalize, notes: Sequence[str]
    ) -> None:
        """Write all parts.

        Parameters
        ----------
        heights : Normalize
            Scale of the obstacles' colours, metres above the road.
        notes : sequence of str
            Sentences below everything else.
        """
        self._sensors(deployment)
        self._targets(site, deployment)
        self._map(geometry, site, sorted({area.weight for area in geometry.weighted_regions}))
        self._heights(heights, assumed=any(mesh.height_assumed for mesh in geometry.occluders))
        if notes:
            self._notes(notes)
        self.axes.set(xlim=(0.0, self.width), ylim=(self.height, 0.0))

    def _keep_together(self, height: float) -> None:
        """Begin another column where this one has no room for what comes next, unless it has only begun."""
        if self.y > 0.0 and self.y + height > self.height:
            self.x, self.y = self.x + LEGEND_WIDTH + COLUMN_GAP, 0.0

    def _sensors(self, deployment: Deployment) -> None:
        """List the sensors that have labels; with their positions if one column has room for that."""
        listed = deployment.sensors[:MAX_LABELLED]
        row = ROW_HEIGHT if HEADING_HEIGHT + len(listed) * ROW_HEIGHT + FOOTNOTE_HEIGHT <= self.height else LINE_HEIGHT
        self._heading("Sensors", row)
        markers = markers_of(deployment)
        for sensor in listed:
            self._keep_together(row)
            self._mark(marker=markers[sensor.model.key], **SENSOR_MARK | {"markersize": 8.0, "mew": 0.8})
            self._text(0.34, sensor.label, weight="bold")
            mounting = f", {sensor.height:.3g} m{sensor.turned}"
            self._text(0.70, _short(sensor.model.name, min(28, 37 - len(mounting))) + mounting)
            self._text(LEGEND_WIDTH, f"{sensor.alone:.0%}", ha="right", weight="bold")
            if row == ROW_HEIGHT:
                below = self.y + ROW_HEIGHT - LINE_HEIGHT
                self._text(0.70, _short(sensor.position_name, 40), y=below, color=SOFT_INK, size=8)
            self.y += row
        if len(deployment.sensors) > len(listed):
            self._line(f"and {len(deployment.sensors) - len(listed)} more", color=SOFT_INK)
        self._footnote("Share of the road that each sees by itself")

    def _targets(self, site: Site, deployment: Deployment) -> None:
        shown = of_placement(deployment)
        self._heading(shown.title, len(shown.words) * LINE_HEIGHT + FOOTNOTE_HEIGHT)
        for words, colour, share in reversed(list(zip(shown.words, shown.colours, shown.shares, strict=True))):
            self._swatch(facecolor=colour)
            self._text(LEGEND_WIDTH, percent(share), ha="right", weight="bold")
            self._line(words)
        self._footnote(f"{counted(len(site.targets), 'point')}, {site.targets.spacing:g} m apart")

    def _map(self, geometry: SceneGeometry, site: Site, weights: Iterable[float]) -> None:
        self._heading("Map", LINE_HEIGHT)
        self._swatch(facecolor="none", edgecolor=INK, linewidth=1.1)
        self._line("region of interest")
        if any(mesh.name.startswith(OTHER_LEVELS) for mesh in geometry.ground):
            self._keep_together(LINE_HEIGHT)
            self._swatch(**OTHER_ROAD)
            self._line("road on another level")
        for weight in weights:
            names = [area.name for area in geometry.weighted_regions if area.weight == weight]
            words = _short(names[0], 20) if len(names) == 1 else counted(len(names), "area")
            self._keep_together(LINE_HEIGHT)
            self._swatch(facecolor="none", edgecolor=WEIGHTED, linewidth=1.4, linestyle=(0, (4, 1.5)))
            self._line(f"{words} (weight {weight:g} where weights count)")
        for areas, colour, hatch, words in (
            (geometry.forbidden_areas, FORBIDDEN, "////", "no sensor here"),
            (geometry.mandatory_areas, MANDATORY, "....", "at least one sensor here"),
        ):
            if areas:
                self._keep_together(LINE_HEIGHT)
                self._swatch(facecolor="none", edgecolor=colour, hatch=hatch, linewidth=0.9)
                self._line(words)
        for count, mark, words in _positions(geometry, site):
            if count:
                self._keep_together(LINE_HEIGHT)
                self._mark(**mark | {"markersize": mark["markersize"] * 1.4})
                self._line(words)
        self.y += 0.14

    def _heights(self, norm: Normalize, *, assumed: bool) -> None:
        self._heading("Obstacles, height above the road", 0.6 + LINE_HEIGHT * assumed)
        highest = float(norm.vmax or 0.0)
        ramp = np.linspace(0.0, highest, 128)[None, :]
        extent = (self.x, self.x + 2.2, self.y + 0.16, self.y)
        self.axes.imshow(HEIGHT_CMAP(norm(ramp)), extent=extent, aspect="auto", interpolation="nearest")
        self.y += 0.3
        for share, align in ((0.0, "left"), (0.5, "center"), (1.0, "right")):
            unit = " m" if share == 1.0 else ""
            self._text(2.2 * share, f"{highest * share:g}{unit}", ha=align, size=8)
        self.y += LINE_HEIGHT + 0.06
        if assumed:
            self._swatch(**ASSUMED_HEIGHT)
            self._line("height assumed")

    def _notes(self, notes: Sequence[str]) -> None:
        self.y += 0.1
        self._heading("Notes", SMALL_LINE_HEIGHT)
        for line in (line for note in notes for line in wrap(note, LETTERS_PER_LINE)):
            self._keep_together(SMALL_LINE_HEIGHT)
            self._text(0.0, line, size=7.5, color=SOFT_INK)
            self.y += SMALL_LINE_HEIGHT

    def _heading(self, words: str, below: float) -> None:
        """Write a heading, in one column with so much of what is below it."""
        self._keep_together(HEADING_HEIGHT + below)
        self._text(0.0, words, weight="bold", size=11, y=self.y + 0.04)
        self.axes.plot((self.x, self.x + LEGEND_WIDTH), (self.y + 0.16,) * 2, color=SOFT_INK, linewidth=0.6)
        self.y += HEADING_HEIGHT

    def _line(self, words: str, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self._text(0.34, words, **style)
        self.y += LINE_HEIGHT

    def _footnote(self, words: str) -> None:
        self._keep_together(LINE_HEIGHT)
        self._text(0.0, words, color=SOFT_INK, size=8)
        self.y += FOOTNOTE_HEIGHT

    def _text(self, x: float, words: str, *, y: float | None = None, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        plain: Style = {"size": 9, "color": INK, "ha": "left", "va": "center", "parse_math": False}
        self.axes.text(self.x + x, self.y if y is None else y, words, **plain | style)

    def _swatch(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.add_patch(Rectangle((self.x + 0.02, self.y - 0.07), 0.2, 0.14, **style))

    def _mark(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.plot(self.x + 0.12, self.y, clip_on=False, **style)


def _positions(geometry: SceneGeometry, site: Site) -> Iterator[tuple[int, Style, str]]:
    """Yield number, mark and legend of each kind of position; assumed poles count that carry no sensor, too."""
    candidates = site.candidates
    existing = candidates.pole_source[candidates.on_pole & (candidates.pole_source != ASSUMED)]
    assumed = sum(pole.source == ASSUMED for pole in geometry.poles)
    used = (candidates.pole_source == ASSUMED).any()
    posts = int(np.count_nonzero(~candidates.on_pole))
    poles = ("pole from the map", "poles from the map") if (existing == FROM_MAP).all() else ("existing pole",)
    yield posts, SIDEWALK_MARK, counted(posts, "possible new post")
    yield len(existing), POLE_MARK, counted(len(existing), *poles)
    yield assumed, ASSUMED_MARK, f"{counted(assumed, 'assumed pole')}{'' if used else ', not used'}"


def _short(words: str, length: int) -> str:
    return words if len(words) <= length else f"{words[: length - 1]}…"
