"""The page on the paper's own case, in Markdown: its claims and figures next to ours, and why they differ."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from headless.studies.claims import Claim
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, CoverageStudy

import numpy as np

from seip_addon.core.estimates import Interval
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.traffic.run_overlap import MATCH_RADIUS

from .figures import ENOUGH_RETURNS, PlacementFigures, Reversal, agreement, leaks, reversals, reversed_pairs
from .published import DIFFERENCES, PUBLISHED_CLAIMS, PUBLISHED_GAINS, PUBLISHED_SENSORS

LEAD = """The case study of Qu, Huang and Suo, *SEIP* (2023): Town05 of CARLA, sensors of types 1 to 3, N = 1, 2, 4,
heights of 3.5, 5.4 and 8 m. Map and traffic are the user's own files, which this project does not include. The page is
written by

    {command}"""

MOST_NAMED = 8  # reversals that are listed


@dataclass(frozen=True)
class CaseFacts:
    """Inputs and circumstances of a run of the command, as text and numbers.

    Parameters
    ----------
    command : str
        Command that writes the page again, without folders.
    scene, criterion, traffic, training : str
        Entries of the table of differences.
    trainings : int
        Number of trainings.
    bare : bool
        Whether no object in the scene blocks the view.
    most_overlap : float
        Overlap with an earlier run above which a run was drawn again.
    overlaps, copied : tuple of float
        Overlaps of all pairs of randomly drawn runs, and of pairs with fixed departures, in ascending order.
    doubts : tuple of str
        Reasons why figures may not be final.
    """

    command: str
    scene: str
    criterion: str
    traffic: str
    training: str
    trainings: int
    bare: bool
    most_overlap: float
    overlaps: tuple[float, ...]
    copied: tuple[float, ...]
    doubts: tuple[str, ...] = ()


def page(
    facts: CaseFacts,
    study: CoverageStudy,
    claims: Sequence[Claim],
    placements: Sequence[PlacementFigures],
    models: Mapping[str, LidarModel],
    charts: Sequence[tuple[str, str]],
) -> str:
    """Return the page.

    Parameters
    ----------
    claims : sequence of Claim
        Claims about coverage and about detection.
    charts : sequence of (str, str)
        Path from the page, and caption.
    """
    parts = [
        "# The paper's own case",
        LEAD.format(command=facts.command),
        *(f"**{doubt}**" for doubt in facts.doubts),
        "## Claims",
        _claims(claims),
        "## Figures",
        "The paper's plots are pictures without values; figures from its text are next to ours.",
        *_figures(study, placements, facts.trainings),
        *(f"![{caption}]({path})\n\n{caption}" for path, caption in charts),
        "## Sensors",
        _sensors(models),
        "## Runs of traffic",
        _runs(facts),
        "## Leak, bare scene or criterion",
        *_reasons(facts, placements),
        "## What differs",
        _table(
            ("", "the paper", "here"),
            [(what, theirs, ours.format(**vars(facts))) for what, theirs, ours in DIFFERENCES],
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _claims(claims: Sequence[Claim]) -> str:
    found = {claim.number: claim for claim in claims}
    rows = []
    for one in PUBLISHED_CLAIMS:
        claim = found.get(one.number)
        ours = (
            ("not measured: `seip study detection --ablation` does", "–")
            if claim is None
            else (claim.evidence, claim.verdict)
        )
        rows.append((str(one.number), one.where, one.says, ours[0], f"**{ours[1]}**"))
    return _table(("#", "in the paper", "the paper", "here", "verdict"), rows)


def _figures(study: CoverageStudy, placements: Sequence[PlacementFigures], trainings: int) -> Iterator[str]:
    numbers = tuple(f"N = {count}" for count in COUNTS)
    yield "Coverage by type, height and number (section V-A):"
    rows = [
        (sensor, "any" if height is None else f"{height:g} m", *(_cover(study, sensor, n, height) for n in COUNTS))
        for sensor in study.sensors
        for height in (*study.heights, None)
    ]
    yield _table(("type", "height", *numbers), rows)
    weighted = list(_weighted(study))
    if weighted:
        yield f"Four sensors, vanilla and with weight {CHARTED_WEIGHT:g} in the centre (section V-B):"
        yield _table(("type", "centre, vanilla", "centre, weighted", "whole, vanilla", "whole, weighted"), weighted)
    one = "one training" if trainings == 1 else f"the mean of {trainings} trainings"
    yield (
        f"Average precision at an overlap of 0.7 from above (section V-C), {one}; in brackets the first training's "
        "95 % interval over test runs. *Returns*: median number of returns from a vehicle, and share of vehicles "
        f"with {ENOUGH_RETURNS} or more. *False*: false positives per frame (section V-D). The last two columns are "
        "for runs with the file's fixed departures (near copies): AP of a detector trained on such runs, and of the "
        "detector of the other columns:"
    )
    head = (
        "placement",
        "coverage",
        "AP",
        "the paper's gain",
        "ours",
        "returns",
        "false",
        "copies, trained on them",
        "copies, not trained on them",
    )
    yield _table(head, list(_precisions(placements)))


def _cover(study: CoverageStudy, sensor: str, count: int, height: float | None) -> str:
    span = study.possible(sensor, count, height)
    if span is None:
        return "no placement"
    low, high = (f"{share:.1%}" for share in span)
    return low if low == high else f"{low} (to {high})"


def _weighted(study: CoverageStudy) -> Iterator[tuple[str, ...]]:
    for sensor in study.sensors:
        plain, weighted = study.find(sensor, COUNTS[-1]), study.find(sensor, COUNTS[-1], weight=CHARTED_WEIGHT)
        if plain is not None and weighted is not None:
            central = [case.deployment.central or 0.0 for case in (plain, weighted)]
            whole = [case.deployment.coverage for case in (plain, weighted)]
            yield (sensor, *(f"{share:.1%}" for share in (*central, *whole)))


def _precisions(placements: Sequence[PlacementFigures]) -> Iterator[tuple[str, ...]]:
    before: dict[str, PlacementFigures] = {}
    for one in placements:
        last = before.get(one.sensor)
        theirs = ours = ""
        if last is not None:
            step = COUNTS.index(one.count) - 1
            theirs = f"+ {PUBLISHED_GAINS[one.sensor][step]}" if one.sensor in PUBLISHED_GAINS else "not given"
            ours = f"{100 * (one.precision - last.precision):+.1f} points"
        before[one.sensor] = one
        yield (
            one.name,
            f"{one.coverage:.1%}",
            f"{one.precision:.1%}{_between(one.interval)}",
            theirs,
            ours,
            f"{one.returns:.0f}, {one.enough:.1%}",
            f"{one.false_positives:.2f}",
            f"{one.copies:.1%}",
            f"{one.unfamiliar:.1%}",
        )


def _sensors(models: Mapping[str, LidarModel]) -> str:
    rows = []
    for published in PUBLISHED_SENSORS:
        model = models.get(published.key)
        if model is None:
            continue
        low, high = np.degrees([model.elevations.min(), model.elevations.max()])
        ours = (model.channels, low, high, model.max_range, model.rotation_rate, model.points_per_second / 1e6)
        theirs = (published.channels, *published.elevations, published.max_range, published.rotation_rate)
        prices = [price / 1000 for price in model.price_range]
        paper, here = _type(*theirs, published.points_per_second / 1e6, *published.price), _type(*ours, *prices)
        rows.append((published.key, paper, "the same" if here == paper else here))
    return _table(("type", "the paper's table of LiDARs", "here"), rows)


def _type(  # noqa: PLR0913, PLR0917  # the columns of the paper's table
    channels: float,
    low: float,
    high: float,
    most: float,
    rate: float,
    points: float,
    least_price: float,
    most_price: float,
) -> str:
    return (
        f"{channels:g} channels, {low:+.0f} to {high:+.0f}°, {most:g} m, {rate:g} Hz, {points:g} million points per "
        f"second, $ {least_price:g} to {most_price:g} thousand"
    )


def _runs(facts: CaseFacts) -> str:
    return (
        f"{facts.traffic}. For each pair of runs, {_range(facts.overlaps)} of the vehicles are within "
        f"{MATCH_RADIUS:g} m of a vehicle of the other run at the same instant. A run was drawn again if it "
        "overlapped an earlier one by more than the largest overlap at the shipped junction "
        f"({facts.most_overlap:.0%}). With the file's own departures, at fixed times, it is {_range(facts.copied)} of "
        "the vehicles, for any of SUMO's seeds. Such runs are near copies: a detector trained on some of them can "
        "recognise the others from memory."
    )


def _reasons(facts: CaseFacts, placements: Sequence[PlacementFigures]) -> Iterator[str]:
    added, known = leaks(placements), np.array([one.copies for one in placements])
    apart = known - [one.precision for one in placements]
    yield (
        "**Leak.** A detector trained on runs with the file's departures and tested on others of them (near copies) "
        f"has an AP of {known.min():.1%} to {known.max():.1%}, a difference of {100 * apart.mean():+.1f} points on "
        "average from that on randomly drawn runs. The leak is the part due to positions, bodies and paint known from "
        "training. It is measured with a detector trained on the same number of randomly drawn runs and tested on the "
        f"same frames: {100 * added.min():+.1f} to {100 * added.max():+.1f} points, {100 * added.mean():+.1f} on "
        "average over the placements (one training each). The rest is due to the traffic, which drives and queues at "
        "different positions."
    )
    least = min(placements, key=lambda one: one.coverage)
    yield (
        "**Scene.** "
        + ("Nothing in this scene except vehicles blocks the view" if facts.bare else facts.scene)
        + f". With {least.name}, which covers {least.coverage:.1%}, {least.enough:.0%} of the vehicles give "
        f"{ENOUGH_RETURNS} returns or more: coverage depends on where the rings of a sensor fall on the road, but a "
        "vehicle between two rings still returns points. The OpenDRIVE map does not contain CARLA's buildings and "
        "trees; their effect was not measured (`--site` adds described ones)."
    )
    found = reversals(placements)
    standing = [one for one in found if one.stands]
    more_returns = sum(one.more_returns for one in found)
    yield (
        f"**Criterion.** Over the {len(placements)} placements AP has a rank correlation of "
        f"{agreement(placements, 'coverage'):.2f} with coverage, {agreement(placements, 'returns'):.2f} with the "
        "median of returns from a vehicle, and "
        f"{agreement(placements, 'enough'):.2f} with the share of vehicles that give "
        f"{ENOUGH_RETURNS} returns or more. In {len(found)} pairs the placement that covers less detects more "
        f"({len(standing)} of them beyond the 95 % interval over test runs); on near copies it does in "
        f"{len(reversed_pairs(placements, 'copies'))} pairs with the detector trained on them, and in "
        f"{len(reversed_pairs(placements, 'unfamiliar'))} with the other. In {more_returns} of the {len(found)} pairs, "
        f"and {sum(one.more_returns for one in standing)} of the {len(standing)} beyond the interval, more vehicles "
        f"give {ENOUGH_RETURNS} returns with the placement that covers less. These are due to the criterion: coverage "
        "of an empty road includes neither occlusion by vehicles nor their number of returns. The others are due to "
        "the training or to chance."
    )
    if found:
        head = (
            "covers less, detects more",
            "covers more, detects less",
            "coverage",
            "AP",
            "gain",
            "returns",
            f"{ENOUGH_RETURNS} or more",
        )
        yield _table(head, [_reversal(one) for one in found[:MOST_NAMED]])


def _reversal(one: Reversal) -> tuple[str, ...]:
    better, worse = one.better, one.worse
    between = "" if one.interval is None else f" ({100 * one.interval[0]:+.1f} to {100 * one.interval[1]:+.1f})"
    return (
        better.name,
        worse.name,
        f"{better.coverage:.1%} and {worse.coverage:.1%}",
        f"{better.precision:.1%} and {worse.precision:.1%}",
        f"{100 * one.gain:+.1f} points{between}",
        f"{better.returns:.0f} and {worse.returns:.0f}",
        f"{better.enough:.1%} and {worse.enough:.1%}",
    )


def _between(interval: Interval | None) -> str:
    return "" if interval is None else f" ({interval[0]:.1%} to {interval[1]:.1%})"


def _range(shares: Sequence[float]) -> str:
    if not shares:
        return "an unknown share"
    return f"{shares[0]:.0%} to {shares[-1]:.0%} ({float(np.median(shares)):.0%} in the middle)"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)
