"""Markdown page on the paper's case study: its claims and figures next to those reproduced, and the differences.

Qu, Huang and Suo, "SEIP: Simulation-based Design and Evaluation of Infrastructure-based Collective Perception", 2023.
Its plots are pictures without values.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from headless.studies.claims import Claim
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, CoverageStudy
from headless.studies.markdown import table

from seip_addon.core.base.estimates import Interval

LEAD = """The case study of Qu, Huang and Suo, *SEIP* (2023): Town05 of CARLA, sensors of types 1 to 3, N = 1, 2, 4,
heights of 3.5, 5.4 and 8 m. The map is the user's own file, which this project does not include. The page is written by

    {}"""

PUBLISHED_GAINS = {"type1": ("about 20 %", "7 %"), "type2": ("10 %", "5 %")}
"""Gains of average precision from one to two and from two to four sensors (V-C); the text gives none for type 3."""
HEIGHTS = (3.5, 5.4, 8.0)  # metres, section V-A
DIFFERENCES = (
    ("Scene", "CARLA's Town05 with its buildings, trees and furniture, meshes of Unreal Engine", "{scene}"),
    ("LiDAR", "CARLA's; its types 1 to 3", "the same types; drop-off as CARLA's, beams evenly spaced"),
    (
        "Seen",
        "a return within δ of the target; δ, grid and spacing of candidates are not given",
        "the same rule; {criterion}",
    ),
    (
        "Weights",
        "central box; its weight is not given",
        "central box of the junction; weights 2, 4, 8 and 16 are tried",
    ),
    ("Solver", "Gurobi", "HiGHS or CBC, with a bound; the optimum is proven unless a row says otherwise"),
    (
        "Traffic",
        "SUMO and CARLA together; length, runs and split into training and test are not given",
        "{traffic}",
    ),
    ("Bodies", "CARLA's meshes of the models", "this program's own bodies; no pedestrians"),
    (
        "Detector",
        "PointPillars of MMDetection3D; settings and training are not given",
        "PointPillars of this program, {training}",
    ),
    (
        "Truth",
        "which vehicles have to be found is not given",
        "all vehicles with their middle in the region, visible or not; rolling shutter",
    ),
    ("AP", "IoU of 0.7 from above; “%” may be points or shares; no intervals", "the same; points; 95 % intervals"),
)
"""Differences: aspect, the paper's entry, and ours, with placeholders that a run of the command fills in."""


@dataclass(frozen=True)
class PublishedClaim:
    """A claim of the paper: its number here, its place in the paper, and the claim in our words."""

    number: int
    where: str
    says: str


PUBLISHED_CLAIMS = (
    PublishedClaim(
        1, "V-A, picture of the locations", "coverage rises with N and with a better type; of type 3 hardly with N"
    ),
    PublishedClaim(2, "V-A, same picture", "four of type 3 cover 100 %; three of them stand together, fewer would do"),
    PublishedClaim(
        3, "V-A, picture of heights", "type 1 covers most from 3.5 m, types 2 and 3 from higher up, at N = 1, 2 and 4"
    ),
    PublishedClaim(
        4,
        "V-B, picture of weights",
        "weights raise the centre's coverage with four of types 1 and 2 at no cost to the whole; type 3 stays the same",
    ),
    PublishedClaim(5, "V-C, picture of accuracy", "type 1: AP + about 20 % from N = 1 to 2, + 7 % from 2 to 4"),
    PublishedClaim(6, "V-C, picture of accuracy", "type 2: AP + 10 % from N = 1 to 2, + 5 % from 2 to 4"),
    PublishedClaim(7, "abstract, V-C", "more sensors of low resolution gain more AP than more of high resolution"),
    PublishedClaim(
        8,
        "V-D, picture of errors",
        "type 1: more false positives with N = 1 and 2 than with 4, mostly in sparse places",
    ),
    PublishedClaim(
        9, "V-D", "padding of pillars with zeros makes these false positives (an explanation, not measured)"
    ),
    PublishedClaim(10, "IV", "greedy placement reaches 1 − 1/e of the optimum (cited)"),
)


@dataclass(frozen=True)
class PlacementFigures:
    """Figures of one placement, measured with detectors.

    Parameters
    ----------
    name, sensor : str
    count : int
    coverage : float, 0 to 1
    precision : float, 0 to 1
        AP, the mean over the trainings.
    interval : (float, float) or None
        Interval of the first training's AP over runs.
    false_positives : float
        False positives per frame.
    """

    name: str
    sensor: str
    count: int
    coverage: float
    precision: float
    interval: Interval | None
    false_positives: float


def page(
    command: str,
    facts: Mapping[str, str],
    study: CoverageStudy,
    claims: Sequence[Claim],
    placements: Sequence[PlacementFigures],
    chart: str,
) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    command : str
        Command that writes the page again, without folders.
    facts : mapping of str to str
        Entries of the table of differences: ``scene``, ``criterion``, ``traffic`` and ``training``.
    study : CoverageStudy
        Solved placements of each type, height, number and central weight.
    claims : sequence of Claim
        Claims about coverage and about detection.
    placements : sequence of PlacementFigures
        Placements measured with detectors; those of one type in ascending number of sensors.
    chart : str
        Path of the chart of coverage, relative to the page.
    """
    parts = [
        "# The paper's own case",
        LEAD.format(command),
        "## Claims",
        _claims(claims),
        "## Figures",
        "The paper's plots are pictures without values; figures from its text are next to ours.",
        *_figures(study, placements),
        f"![Coverage by type, height and number]({chart})",
        "## What differs",
        table(
            ("", "the paper", "here"),
            [(aspect, theirs, ours.format(**facts)) for aspect, theirs, ours in DIFFERENCES],
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _claims(claims: Sequence[Claim]) -> str:
    """Return the table of the published claims with evidence and verdict."""
    measured = {claim.number: (claim.evidence, f"**{claim.verdict}**") for claim in claims}
    rows = [
        (str(one.number), one.where, one.says, *measured.get(one.number, ("not measured", "–")))
        for one in PUBLISHED_CLAIMS
    ]
    return table(("#", "in the paper", "the paper", "here", "verdict"), rows)


def _figures(study: CoverageStudy, placements: Sequence[PlacementFigures]) -> Iterator[str]:
    """Yield captions and tables of coverage, of central weights, and of average precision."""
    numbers = tuple(f"N = {count}" for count in COUNTS)
    yield "Coverage by type, height and number (section V-A):"
    rows = [
        (sensor, "any" if height is None else f"{height:g} m", *(_coverage(study, sensor, n, height) for n in COUNTS))
        for sensor in study.sensors
        for height in (*study.heights, None)
    ]
    yield table(("type", "height", *numbers), rows)
    weighted = list(_weighted(study))
    if weighted:
        yield f"Four sensors, vanilla and with weight {CHARTED_WEIGHT:g} in the centre (section V-B):"
        yield table(("type", "centre, vanilla", "centre, weighted", "whole, vanilla", "whole, weighted"), weighted)
    yield (
        "Average precision at an overlap of 0.7 from above (section V-C), the mean over the trainings; in brackets the "
        "first training's 95 % interval over test runs. *False*: false positives per frame (section V-D)."
    )
    yield table(("placement", "coverage", "AP", "the paper's gain", "ours", "false"), list(_precisions(placements)))


def _coverage(study: CoverageStudy, sensor: str, count: int, height: float | None) -> str:
    """Return the largest coverage, with its upper bound if the optimum is not proven."""
    span = study.possible(sensor, count, height)
    if span is None:
        return "no placement"
    low, high = (f"{share:.1%}" for share in span)
    return low if low == high else f"{low} (to {high})"


def _weighted(study: CoverageStudy) -> Iterator[tuple[str, ...]]:
    """Yield for each type the central and the whole coverage without and with the charted weight."""
    for sensor in study.sensors:
        plain, weighted = study.find(sensor, COUNTS[-1]), study.find(sensor, COUNTS[-1], weight=CHARTED_WEIGHT)
        if plain is not None and weighted is not None:
            central = [case.deployment.central or 0.0 for case in (plain, weighted)]
            whole = [case.deployment.coverage for case in (plain, weighted)]
            yield (sensor, *(f"{share:.1%}" for share in (*central, *whole)))


def _precisions(placements: Sequence[PlacementFigures]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each placement, with its gain over the previous one of the same type."""
    previous: dict[str, PlacementFigures] = {}
    for one in placements:
        fewer = previous.get(one.sensor)
        theirs = ours = ""
        if fewer is not None:
            step = COUNTS.index(one.count) - 1
            theirs = f"+ {PUBLISHED_GAINS[one.sensor][step]}" if one.sensor in PUBLISHED_GAINS else "not given"
            ours = f"{100 * (one.precision - fewer.precision):+.1f} points"
        previous[one.sensor] = one
        interval = "" if one.interval is None else f" ({one.interval[0]:.1%} to {one.interval[1]:.1%})"
        precision = f"{one.precision:.1%}{interval}"
        yield one.name, f"{one.coverage:.1%}", precision, theirs, ours, f"{one.false_positives:.2f}"
