"""Charts that compare LiDAR models with measured sweeps.

They show the share of rays that return, the noise of ranges, and the correlation between neighbouring rays.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

from headless.studies.calibration.comparison import CHART_LAGS, Comparison
from headless.studies.calibration.reference import NoiseBin, ShareBin
from headless.studies.calibration.share_fit import VERTICAL_REFLECTIVITY, fitted, ground_reflected

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator, PercentFormatter

from seip_addon.core.arrays import Float
from seip_addon.core.output.pictures.chart_style import DASHED, new_figure, save_chart, style_axes
from seip_addon.core.output.pictures.palette import INK, SERIES_COLOURS

PANEL, HEIGHT, NARROWEST = 3.4, 3.9, 6.0  # inches
FARTHEST = 100.0  # metres
_MEASURED = "measured share, with 95 % interval"


def save_ground_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison]) -> None:
    """Draw the share of rays at ground that return against range, as PNG."""
    _save_share_chart(
        path,
        comparisons,
        "Share of rays to the ground that return",
        lambda one: one.sensor.ground_by_range_m,
        _on_ground,
    )


def save_vertical_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison]) -> None:
    """Draw the share of rays at vertical surfaces that return against range, as PNG."""
    _save_share_chart(
        path,
        comparisons,
        "Share of rays to vertical surfaces that return",
        lambda one: one.sensor.vertical_by_range_m,
        _on_vertical,
    )


def save_noise_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison]) -> None:
    """Draw the noise of ranges against range, as PNG."""
    figure, panels = _new_figure(len(comparisons))
    distance = np.linspace(1.0, FARTHEST, 200)
    for panel, one in zip(panels, comparisons, strict=True):
        panel.plot(
            distance, 1000.0 * one.model.range_noise(distance), color=SERIES_COLOURS[0], label="model of the sensor"
        )
        for surface, marker, bins in (
            ("walls and other vertical surfaces", "s", one.sensor.range_noise_vertical),
            ("ground, including its unevenness", "o", one.sensor.range_noise_ground),
        ):
            shown: list[NoiseBin] = [each for each in bins if each.high <= FARTHEST]
            panel.plot(
                [each.middle for each in shown],
                [1000.0 * each.robust_std_m for each in shown],
                marker=marker,
                linestyle="none",
                color=INK,
                markerfacecolor=INK if marker == "s" else "none",
                label=f"measured on {surface}",
            )
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.yaxis.set_major_formatter("{x:g}")
        panel.yaxis.set_minor_locator(NullLocator())
        _finish(panel, one, "range, m", "standard deviation of range, mm" if panel is panels[0] else "")
    save_chart(path, figure, "Noise of measured ranges", panels[:1])


def save_fate_chart(path: str | os.PathLike[str], comparisons: Sequence[Comparison]) -> None:
    """Draw the correlation between rays of being returned or lost, against their distance along the ring, as PNG."""
    figure, panels = _new_figure(len(comparisons))
    for panel, one in zip(panels, comparisons, strict=True):
        model = one.fates.along_ring
        if model:
            panel.plot(
                CHART_LAGS, [model[lag] for lag in CHART_LAGS], color=SERIES_COLOURS[0], label="model of the sensor"
            )
        measured = one.sensor.fate_correlation
        panel.plot(list(measured), list(measured.values()), "o", color=INK, label="measured")
        _finish(
            panel, one, "distance along the ring, in rays", "correlation (0: independent)" if panel is panels[0] else ""
        )
        panel.set_ylim(min([0.0, *measured.values()]), 1.0)
    save_chart(
        path, figure, "Correlation between neighbouring rays of being returned or lost, at 20 to 100 m", panels[:1]
    )


def _save_share_chart(
    path: str | os.PathLike[str],
    comparisons: Sequence[Comparison],
    title: str,
    bins_of: Callable[[Comparison], Sequence[ShareBin]],
    reflected: Callable[[Comparison, Float], Float],
) -> None:
    figure, panels = _new_figure(len(comparisons))
    distance = np.linspace(1.0, FARTHEST, 400)
    for panel, one in zip(panels, comparisons, strict=True):
        if one.fits is not None:
            for law, label, colour, dashes in (
                (one.fits.catalogue, "model with the values of the catalogue", SERIES_COLOURS[0], "-"),
                (one.fits.gain, "model with fitted sensitivity (m)", SERIES_COLOURS[1], DASHED),
                (one.fits.free, "model with all values fitted (m, s, c)", SERIES_COLOURS[2], "-"),
            ):
                share = law.chance(distance, reflected(one, distance))
                panel.plot(distance, share, color=colour, linestyle=dashes, label=label)
        closed = [each for each in bins_of(one) if each.high <= FARTHEST]
        _draw_measured(panel, [each for each in closed if fitted(each)], INK, _MEASURED)
        _draw_measured(
            panel, [each for each in closed if not fitted(each)], "none", "measured share, not used for the fit"
        )
        panel.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
        panel.set_ylim(0.0, 1.03)
        _finish(panel, one, "range, m", "share of rays" if panel is panels[0] else "")
    save_chart(path, figure, title, panels[:1])


def _new_figure(panels: int) -> tuple[Figure, Sequence[Axes]]:
    return new_figure(max(PANEL * panels + 0.6, NARROWEST), HEIGHT, panels, sharey=True)


def _draw_measured(panel: Axes, bins: Sequence[ShareBin], face: str, label: str) -> None:
    middle, share = [one.middle for one in bins], [one.share for one in bins]
    ends = np.array([one.sector_bootstrap95 for one in bins]).reshape(-1, 2).T
    panel.vlines(middle, *ends, color=INK, linewidth=1.0)
    panel.plot(middle, share, "o", color=INK, markerfacecolor=face, label=label, markersize=5)


def _on_ground(one: Comparison, distance: Float) -> Float:
    return ground_reflected(one.sensor, distance)


def _on_vertical(one: Comparison, distance: Float) -> Float:
    bins = [each for each in one.sensor.vertical_by_range_m if each.high <= FARTHEST]
    cos = np.interp(distance, [each.middle for each in bins], [each.mean_cos_incidence for each in bins])
    reflected: Float = VERTICAL_REFLECTIVITY * cos
    return reflected


def _finish(panel: Axes, one: Comparison, x: str, y: str) -> None:
    style_axes(panel, x, y)
    name = one.name if one.name == one.model.key else f"{one.name}, model {one.model.key}"
    panel.set_title(name, fontsize=10, color=INK, parse_math=False)
