"""The legend beside a plan: sensors, shares of the road, and what lines and marks mean."""

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle

from ..placement.deployment import Deployment
from ..site.scene_geometry import ASSUMED, FROM_MAP, SceneGeometry
from ..site.site import Site
from .drawing import SENSOR_MARK, markers_of, percent
from .palette import INK, SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS, SOFT_INK
from .plan_style import (
    ASSUMED_HEIGHT,
    ASSUMED_MARK,
    FORBIDDEN,
    HEIGHT_CMAP,
    MANDATORY,
    POLE_MARK,
    SIDEWALK_MARK,
    WEIGHTED,
    Style,
)

LEGEND_WIDTH = 3.7  # inches
ROW_HEIGHT, LINE_HEIGHT, SMALL_LINE_HEIGHT = 0.42, 0.24, 0.15  # inches
LETTERS_PER_LINE = 62  # of small text that fit into a line


class PlanLegend:
    """The legend, written from top to bottom; lengths in inches.

    Parameters
    ----------
    axes : Axes
        `LEGEND_WIDTH` wide.
    height : float, inches
        Of the axes.
    """

    def __init__(self, axes: Axes, height: float) -> None:
        self.axes = axes
        self.height = height
        self.y = 0.0
        axes.set(xlim=(0.0, LEGEND_WIDTH), ylim=(height, 0.0))
        axes.axis("off")

    def draw(
        self, geometry: SceneGeometry, site: Site, deployment: Deployment, heights: Normalize, notes: Sequence[str]
    ) -> None:
        """Write all parts, with as many sensors as there is room for.

        Parameters
        ----------
        heights : Normalize
            Scale of the obstacles' colours, metres above the road.
        notes : sequence of str
            Sentences below everything else.
        """
        weights = sorted({area.weight for area in geometry.weighted_regions})
        lines = [line for note in notes for line in wrap(note, LETTERS_PER_LINE)]
        assumed = any(pole.source == ASSUMED for pole in geometry.poles)
        by_guess = any(mesh.height_assumed for mesh in geometry.occluders)
        below = 3.72 + LINE_HEIGHT * (
            3 + assumed + by_guess + len(weights) + bool(geometry.forbidden_areas) + bool(geometry.mandatory_areas)
        )
        below += 0.5 + SMALL_LINE_HEIGHT * len(lines) if lines else 0.0
        self._sensors(deployment, self.height - below)
        self._targets(site, deployment)
        self._map(geometry, site, weights)
        self._heights(heights, assumed=by_guess)
        if lines:
            self._notes(lines)

    def _sensors(self, deployment: Deployment, room: float) -> None:
        """List the sensors, without their positions where room is short, and as many as fit."""
        detailed = len(deployment.sensors) * ROW_HEIGHT <= room
        rows = max(1, int(room / (ROW_HEIGHT if detailed else LINE_HEIGHT)))
        self._heading("Sensors")
        markers = markers_of(deployment)
        for sensor in deployment.sensors[:rows]:
            self._mark(marker=markers[sensor.model.key], **SENSOR_MARK | {"markersize": 8.0, "mew": 0.8})
            self._text(0.34, sensor.label, weight="bold")
            mounting = f", {sensor.height:.3g} m{sensor.turned}"
            self._text(0.70, _short(sensor.model.name, min(28, 37 - len(mounting))) + mounting)
            self._text(LEGEND_WIDTH, f"{sensor.alone:.0%}", ha="right", weight="bold")
            if detailed:
                below = self.y + ROW_HEIGHT - LINE_HEIGHT
                self._text(0.70, _short(sensor.position_name, 40), y=below, color=SOFT_INK, size=8)
            self.y += ROW_HEIGHT if detailed else LINE_HEIGHT
        if len(deployment.sensors) > rows:
            self._text(0.34, f"and {len(deployment.sensors) - rows} more", color=SOFT_INK)
            self.y += LINE_HEIGHT
        self._text(0.0, "Share of the road that each sees by itself", color=SOFT_INK, size=8)
        self.y += 0.38

    def _targets(self, site: Site, deployment: Deployment) -> None:
        self._heading("Road")
        counts = np.bincount(np.minimum(deployment.seen_by, SEEN_TWICE), minlength=SEEN_TWICE + 1)
        for times in reversed(range(SEEN_TWICE + 1)):
            self._swatch(facecolor=SEEN_COLOURS[times])
            self._text(0.34, SEEN_WORDS[times])
            self._text(LEGEND_WIDTH, percent(counts[times] / len(site.targets)), ha="right", weight="bold")
            self.y += LINE_HEIGHT
        self._text(0.0, f"{len(site.targets):,} points, {site.targets.spacing:g} m apart", color=SOFT_INK, size=8)
        self.y += 0.38

    def _map(self, geometry: SceneGeometry, site: Site, weights: Iterable[float]) -> None:
        self._heading("Map")
        self._swatch(facecolor="none", edgecolor=INK, linewidth=1.1)
        self._line("region of interest")
        for weight in weights:
            names = [area.name for area in geometry.weighted_regions if area.weight == weight]
            words = _short(names[0], 20) if len(names) == 1 else f"{len(names)} areas"
            self._swatch(facecolor="none", edgecolor=WEIGHTED, linewidth=1.4, linestyle=(0, (4, 1.5)))
            self._line(f"{words} (weight {weight:g} where weights count)")
        for areas, colour, hatch, words in (
            (geometry.forbidden_areas, FORBIDDEN, "////", "no sensor here"),
            (geometry.mandatory_areas, MANDATORY, "....", "at least one sensor here"),
        ):
            if areas:
                self._swatch(facecolor="none", edgecolor=colour, hatch=hatch, linewidth=0.9)
                self._line(words)
        for count, mark, words in _positions(geometry, site):
            if count:
                self._mark(**mark | {"markersize": mark["markersize"] * 1.4})
                self._line(f"{count} {words}")
        self.y += 0.14

    def _heights(self, norm: Normalize, *, assumed: bool) -> None:
        self._heading("Obstacles, height above the road")
        highest = float(norm.vmax or 0.0)
        ramp = np.linspace(0.0, highest, 128)[None, :]
        self.axes.imshow(
            HEIGHT_CMAP(norm(ramp)), extent=(0.0, 2.2, self.y + 0.16, self.y), aspect="auto", interpolation="nearest"
        )
        self.axes.set(xlim=(0.0, LEGEND_WIDTH), ylim=self.axes.get_ylim())
        self.y += 0.3
        for share, align in ((0.0, "left"), (0.5, "center"), (1.0, "right")):
            unit = " m" if share == 1.0 else ""
            self._text(2.2 * share, f"{highest * share:g}{unit}", ha=align, size=8)
        if assumed:
            self.y += LINE_HEIGHT + 0.06
            self._swatch(**ASSUMED_HEIGHT)
            self._text(0.34, "height assumed")

    def _notes(self, lines: Iterable[str]) -> None:
        self.y += 0.34
        self._heading("Notes")
        for line in lines:
            self._text(0.0, line, size=7.5, color=SOFT_INK)
            self.y += SMALL_LINE_HEIGHT

    def _heading(self, words: str) -> None:
        self._text(0.0, words, weight="bold", size=11, y=self.y + 0.04)
        self.axes.plot((0.0, LEGEND_WIDTH), (self.y + 0.16,) * 2, color=SOFT_INK, linewidth=0.6)
        self.y += 0.36

    def _line(self, words: str) -> None:
        self._text(0.34, words)
        self.y += LINE_HEIGHT

    def _text(self, x: float, words: str, *, y: float | None = None, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        plain: Style = {"size": 9, "color": INK, "ha": "left", "va": "center", "parse_math": False}
        self.axes.text(x, self.y if y is None else y, words, **plain | style)

    def _swatch(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.add_patch(Rectangle((0.02, self.y - 0.07), 0.2, 0.14, **style))

    def _mark(self, **style: Any) -> None:  # noqa: ANN401 - matplotlib's own
        self.axes.plot(0.12, self.y, clip_on=False, **style)


def _positions(geometry: SceneGeometry, site: Site) -> Iterator[tuple[int, Style, str]]:
    """Yield number, mark and words of each kind of place for a sensor; assumed poles count that carry none, too."""
    candidates = site.candidates
    existing = candidates.pole_source[candidates.on_pole & (candidates.pole_source != ASSUMED)]
    assumed = sum(pole.source == ASSUMED for pole in geometry.poles)
    used = (candidates.pole_source == ASSUMED).any()
    yield np.count_nonzero(~candidates.on_pole), SIDEWALK_MARK, "possible new posts"
    yield len(existing), POLE_MARK, "poles from the map" if (existing == FROM_MAP).all() else "existing poles"
    yield assumed, ASSUMED_MARK, f"assumed pole{'s' * (assumed > 1)}{'' if used else ', not used'}"


def _short(words: str, length: int) -> str:
    return words if len(words) <= length else f"{words[: length - 1]}…"
