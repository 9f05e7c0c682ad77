"""The chapter of the benchmark's page on models of one LiDAR: text, table and chart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

from headless.studies.benchmark.pareto_front import Method
from headless.studies.benchmark.pictures import save_trade_off_chart
from headless.studies.benchmark.sensor_models import (
    FINEST,
    PLAIN,
    SHIPPED,
    PrecisionFront,
    SensorModelFindings,
    SiteFront,
)
from headless.studies.benchmark.visibility import Cost

from seip_addon.core.estimates import IntervalEstimate

CHART = "sensor_models.png"
NEGLIGIBLE = 0.0025
"""Change of coverage below which a part of the model is left out, significant or not: a quarter of a point."""

HEAD = (
    "where",
    "model",
    "s",
    "rays",
    "1 sensor",
    "2 sensors",
    "4 sensors",
    "best 4 by the model: claimed, in truth",
)


def save_sensor_model_chart(folder: Path, findings: SensorModelFindings) -> None:
    """Draw processor time against the change of coverage, and of average precision, as PNG."""
    panels = {
        f"coverage off, {one.site}": _methods(one.costs, {name: one.change(name) for name in one.costs})
        for one in findings.sites
    }
    if findings.precision is not None:
        own = findings.precision
        panels[f"average precision off, {own.site}"] = _methods(own.costs, own.change)
    save_trade_off_chart(
        folder / CHART,
        panels,
        f"Models of {findings.sensor}: processor time against the distance from diverging beams",
        f"coverage: mean over {findings.placements} random placements of each number of sensors · bars: 95 % intervals",
        linear_below=1e-3,
    )


def sensor_model_parts(findings: SensorModelFindings, pictures: str) -> list[str]:
    """Return heading, text, picture and table; ``pictures`` is the folder of the charts, as seen from the page."""
    rows = [row for one in findings.sites for row in _site_rows(one)]
    text = (
        f"Visibility of every candidate of `{findings.sensor}`, by three models. *{_titled(PLAIN)}*: every return "
        f"within the range is detected. *{_titled(SHIPPED)}*: as shipped. *{_titled(FINEST)}*: the range equation, "
        "with five rays for each beam, one along its axis and four at the edge of a divergence of "
        f"{math.degrees(findings.divergence):.2g}° (full width at half of the power); the beam's return is the middle "
        "one of the five by range. The column of rays counts each of the five. Coverage is the mean over the same "
        f"{findings.placements} random placements of 1, 2 and 4 sensors. Brackets give the difference from diverging "
        "beams in points (paired bootstrap over placements, 95 %). The last column is for the best placement by each "
        "model (one of several equally good ones): the coverage that the model claims, and the coverage with diverging "
        "beams. A bare site has nothing that blocks the view. Rows of a site stay until that site is measured again."
    )
    if findings.precision is not None:
        text += " " + _about_precision(findings.precision)
        rows += _precision_rows(findings.precision)
    picture = f"![processor time against what a model of the sensor changes]({pictures}/{CHART})"
    return ["## Models of the sensor", text, picture, table(HEAD, rows), _verdict(findings)]


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def differs(estimate: IntervalEstimate) -> bool:
    """Return whether the interval of a change excludes zero."""
    return estimate.low > 0 or estimate.high < 0


def _methods(costs: Mapping[str, Cost], changes: Mapping[str, IntervalEstimate]) -> list[Method]:
    return [
        Method(name, name, cost.seconds, abs(changes[name].value), name == SHIPPED, _distance(changes[name]))
        for name, cost in costs.items()
    ]


def _distance(change: IntervalEstimate) -> tuple[float, float]:
    """Return the interval of a change without its sign."""
    ends = sorted((abs(change.low), abs(change.high)))
    return (ends[0] if differs(change) else 0.0), ends[1]


def _site_rows(front: SiteFront) -> Iterable[tuple[str, ...]]:
    for name, cost in front.costs.items():
        counts = front.coverage[name]
        covered = [
            f"{sum(own) / len(own):.1%}" + ("" if name == FINEST else f" ({_points(front.change(name, n))})")
            for n, own in counts.items()
        ]
        claimed, true = list(front.best[name].values())[-1]
        yield (
            f"{front.site}{', bare' if front.bare else ''}",
            name,
            f"{cost.seconds:.3g}",
            f"{cost.rays:,}",
            *covered,
            f"{claimed:.1%}, {true:.1%}",
        )


def _precision_rows(front: PrecisionFront) -> Iterable[tuple[str, ...]]:
    for name, cost in front.costs.items():
        value = f"{front.precision[name].value:.1%}"
        value += "" if name == FINEST else f" ({_points(front.change[name])})"
        where = f"average precision, {front.site}"
        yield where, name, f"{cost.seconds:.3g}", f"{cost.rays:,}", "–", "–", value, "–"


def _about_precision(front: PrecisionFront) -> str:
    return (
        "Average precision (overlap of 0.7 in plan) is that of one detector, trained in "
        f"{front.steps:,} steps on scans of {front.placed} drawn with the range equation, on the same {front.frames} "
        "test frames scanned by each model. Its intervals are over blocks of traffic; they do not include the "
        "variation between trainings."
    )


def _verdict(findings: SensorModelFindings) -> str:
    law, beams = _changes(findings, PLAIN), _changes(findings, SHIPPED)
    least, most = min(abs(one.value) for one in law), max(abs(one.value) for one in law)
    largest = max(abs(one.value) for one in beams)
    slower = [one.costs[FINEST].seconds / one.costs[SHIPPED].seconds for one in findings.sites]
    differing, compared = (sum(getattr(one, part) for one in findings.sites) for part in ("differing", "compared"))
    lost = [_own(one, FINEST) - _own(one, PLAIN) for one in findings.sites]
    left_out = ": it is left out" if largest < NEGLIGIBLE else ""
    text = (
        f"The law of detection changes coverage by {100 * least:.1f} to {100 * most:.1f} points, significantly in "
        f"{sum(map(differs, law))} of {len(law)} comparisons; the best placement by "
        f"plain range covers {100 * min(lost):.1f} to {100 * max(lost):.1f} points less. Divergence changes it by "
        f"at most {100 * largest:.2f} points, significantly in {sum(map(differs, beams))} of {len(beams)} comparisons, "
        f"and takes {_span(slower)} times as long{left_out}. The lazy engine is made for beams that are lines: for "
        f"{differing} of {compared:,} visible pairs of pose and target it differs from casting every diverging beam."
    )
    if findings.precision is not None:
        change = findings.precision.change
        text += (
            f" Average precision differs from that with diverging beams by {_points(change[PLAIN])} points with plain "
            "range, "
            f"{_significance(change[PLAIN])}, and by {_points(change[SHIPPED])} with the range equation, "
            f"{_significance(change[SHIPPED])}: its detector was trained on beams that are lines."
        )
    return text


def _own(front: SiteFront, model: str) -> float:
    """Return the coverage by the finest model of a model's best placement with the most sensors."""
    return list(front.best[model].values())[-1][1]


def _changes(findings: SensorModelFindings, model: str) -> list[IntervalEstimate]:
    return [one.change(model, count) for one in findings.sites for count in one.coverage[model]]


def _significance(change: IntervalEstimate) -> str:
    return "significant" if differs(change) else "not significant"


def _points(change: IntervalEstimate) -> str:
    value, low, high = (f"{round(100 * part, 2) + 0.0:+.2f}" for part in (change.value, change.low, change.high))
    return f"{value} [{low}, {high}]"


def _span(values: list[float]) -> str:
    low, high = f"{min(values):.2g}", f"{max(values):.2g}"
    return low if low == high else f"{low} to {high}"


def _titled(name: str) -> str:
    return name[0].upper() + name[1:]
