"""Chart of a survey's boxes: their number by tolerance, and the lines of sight that they change."""

import os
from collections.abc import Sequence

from seip_addon.core.output.pictures.chart_style import MARKERS, colour, new_figure, save_chart, style_axes
from seip_addon.core.output.pictures.palette import INK, SOFT_INK
from seip_addon.core.world.elevation.obstacles import MAX_CHANGED, RAYS, Merging, chosen_merging


def save_merging_chart(path: str | os.PathLike[str], tried: Sequence[Merging]) -> None:
    """Draw the share of changed lines of sight over the number of boxes, one mark for each tolerance.

    Raises
    ------
    SeipError
        The file cannot be written.
    """
    figure, (panel,) = new_figure(7.0, 4.2)
    boxes, changed = [one.boxes for one in tried], [100 * one.changed for one in tried]
    panel.plot(boxes, changed, color=colour(1), marker=MARKERS[0])
    chosen = chosen_merging(tried)
    panel.plot([chosen.boxes], [100 * chosen.changed], MARKERS[0], color=colour(0), markersize=10)
    panel.axhline(100 * MAX_CHANGED, color=SOFT_INK, linewidth=0.8, linestyle="dashed")
    for one in tried:
        place = (one.boxes, 100 * one.changed)
        panel.annotate(f"{one.tolerance:g} m", place, (6, 6), textcoords="offset points", color=INK, fontsize=9)
    panel.set_xscale("log")
    panel.set_ylim(bottom=0)
    style_axes(panel, "boxes", f"lines of sight that differ, % of {RAYS:,} random ones")
    save_chart(path, figure, f"Boxes for what the survey has above the ground: {chosen.boxes:,} taken")
