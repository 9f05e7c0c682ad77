"""Scale bar and north arrow of a map."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ...counts import round_number
from .drawing import Style
from .palette import INK, PAPER

SCALE_SIZE = 9.0  # points
TEXT = 6.0  # drawing order: over the map and under its sensors


def draw_scale(plan: Axes, inch: float, longest: float = 2.0) -> None:
    """Draw a scale bar of a round length, at most ``longest`` inches; ``inch`` is an inch of the plan in metres."""
    length = round_number(longest * inch)
    left, bottom = plan.get_xlim()[0] + 0.25 * inch, plan.get_ylim()[0] + 0.25 * inch
    _draw_paper(plan, *scale_paper(plan.get_xlim()[0], plan.get_ylim()[0], inch, longest))
    for part in range(4):
        style: Style = {"facecolor": INK if part % 2 == 0 else PAPER, "edgecolor": INK, "linewidth": 0.7}
        plan.add_patch(Rectangle((left + part * length / 4, bottom), length / 4, 0.08 * inch, zorder=TEXT, **style))
    unit, name = (1000.0, "km") if length >= 2000.0 else (1.0, "m")
    ends = ((0.0, "0"), (length / 2, f"{length / 2 / unit:g}"), (length, f"{length / unit:g} {name}"))
    for at, words in ends if longest > 1.0 else ends[::2]:
        style = {"ha": "center", "va": "bottom", "size": SCALE_SIZE, "color": INK, "zorder": TEXT}
        plan.text(left + at, bottom + 0.13 * inch, words, **style)


def scale_paper(left: float, bottom: float, inch: float, longest: float = 2.0) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of what the scale is drawn on, in the map's lower left corner."""
    return left + 0.12 * inch, bottom + 0.13 * inch, round_number(longest * inch) + 0.55 * inch, 0.52 * inch


def north_paper(right: float, top: float, inch: float) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of what the north arrow is drawn on, in the map's upper right corner."""
    return right - 0.62 * inch, top - 0.92 * inch, 0.48 * inch, 0.8 * inch


def _draw_paper(plan: Axes, left: float, bottom: float, width: float, height: float) -> None:
    style: Style = {"facecolor": PAPER, "alpha": 0.9, "edgecolor": "none", "zorder": TEXT}
    plan.add_patch(Rectangle((left, bottom), width, height, **style))


def draw_north(plan: Axes, inch: float) -> None:
    """Draw an arrow along +y, which is north in map coordinates."""
    right, top = plan.get_xlim()[1], plan.get_ylim()[1]
    x, y = right - 0.38 * inch, top - 0.82 * inch
    _draw_paper(plan, *north_paper(right, top, inch))
    arrow = np.array([(0.0, 0.42), (0.12, 0.0), (0.0, 0.09), (-0.12, 0.0)]) * inch + (x, y)
    plan.fill(arrow[:, 0], arrow[:, 1], facecolor=INK, edgecolor="none", zorder=TEXT)
    plan.text(x, y + 0.46 * inch, "N", ha="center", va="bottom", size=9, weight="bold", color=INK, zorder=TEXT)
