"""The sections of a report, in words that a city engineer reads."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Float
from ...choosing.placement.cheapest import SAME_PRICE
from ...choosing.placement.deployment import BAND, UNRANKED
from ...choosing.placement.objective import CHOSEN_FOR, MOVED, MOVED_MESSAGE, Objective, certificate, purpose
from ...counts import counted
from ...site.sources import source_table
from ..pictures.drawing import percent
from ..results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURES
from ..results.located import LOCATED_FILES
from ..results.placement_record import RecordedObjective, relevant_warnings
from .blind_spots import BlindSpot, blind_spots, centres, seen_places
from .blocks import Block, Bullets, Code, Paragraph, Picture, Report, Section, Table
from .evidence import Evidence
from .figures import blind_spot_map, front_chart
from .losses import FrontPoint, equal_prices, failures
from .repeat import repeating_command

MOST_SPOTS = 8
MIN_DIFFERENCE = 1e-6  # share of the road by which two coverages differ at least; records have nine digits
Row = tuple[str, ...]
POSE_ERRORS = "with errors of"
"""How the note begins that says what pose errors cost."""
CAPTIONS = {
    "spread.png": "Coverage over draws of pose errors that were not used for choosing.",
    "blame.png": "What each sensor's errors, and each kind of error, cost on average.",
    "frontier.png": "What is lost as planned for what is gained where poses err.",
    "time_seen.png": "For which share of the time each part of the road is seen in traffic.",
    "traffic.png": "The empty road and the road in traffic.",
}


def make_report(evidence: Evidence, points: Sequence[FrontPoint]) -> Report:
    """Return the report on a placement.

    Parameters
    ----------
    points : sequence of FrontPoint
        Best choices of other numbers of sensors; empty where they were not looked for.
    """
    record = evidence.record
    sections = (
        Section("Objective", tuple(_question(evidence))),
        Section("Site", tuple(_site(evidence))),
        Section("Sensors", tuple(_sensors(evidence))),
        Section("Coverage", tuple(_coverage(evidence))),
        Section("Blind spots", tuple(_blind_spots(evidence))),
        Section("Optimality", tuple(_certificate(evidence, points))),
        Section("Failures and errors", tuple(_losses(evidence))),
        Section("Fewer or more sensors", tuple(_front(evidence, points))),
        Section("Warnings and limits", tuple(_warnings(evidence))),
        Section("Reproduction", tuple(_making(evidence))),
    )
    coverage = record.coverage
    central = "" if coverage.central is None else f", {percent(coverage.central)} of its weighted part"
    band = coverage.gain_band
    between = f" ({percent(band.low)} to {percent(band.high)} {BAND})" if band is not None and band.sheets else ""
    returns = "" if record.returns is None else f"{_sentence(record.returns.describe())} "
    summary = (
        f"{returns}{counted(len(record.sensors), 'sensor sees', 'sensors see')} "
        f"{percent(coverage.whole)} of the road{between}{central}, for {record.price_text}."
    )
    return Report(record.site.name, summary, record.times.created, sections)


def certificate_sentence(evidence: Evidence) -> str:
    """Return the sentence on the proven optimality gap among the same positions."""
    record = evidence.record
    found, places = record.objective, record.counts.positions
    if found.status == MOVED:
        return MOVED_MESSAGE
    if any(note.startswith(CHOSEN_FOR) for note in record.notes):
        return certificate(found.status, found.gap, cheapest=found.cheapest, notes=record.notes)
    choice = f"choice{_limits(record.request.goal, 'of')} among the {places:,} positions, under the same rules,"
    if found.bound is None:
        return f"Another {choice} may be better; how much better is not known."
    better = _cheaper(found) if found.cheapest else _more_coverage(evidence)
    proven = "this is proven" if found.status == "optimal" else "this bound is proven"
    return f"No other {choice} {better}: {proven}."


def _limits(goal: Objective, joint: str) -> str:
    """Return the limits on a placement, its number of sensors after a word and its price, as the end of a sentence."""
    count = "" if goal.count is None else f" {joint} at most {counted(goal.count, 'sensor')}"
    return count if goal.budget is None else f"{count} for at most {_dollars(goal.budget)}"


def _cheaper(found: RecordedObjective) -> str:
    if found.status == "optimal" or found.bound is None:
        return "reaches the required coverage at a lower price"
    return f"is more than {_dollars(max(0.0, found.value - found.bound))} cheaper"


def _more_coverage(evidence: Evidence) -> str:
    found = evidence.record.objective
    what = "of the road" if found.kind == "vanilla" else "of the road, counted by its weights"
    if found.status == "optimal" or found.bound is None:
        return f"covers more {what}"
    more = max(0.0, found.bound - found.value) / math.fsum(evidence.site.problem.weights)
    return f"covers more than {_points(more)} more {what}"


def _question(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    goal, counts = record.request.goal, record.counts
    limits = _limits(goal, "with")
    with_limits = f",{limits}" if limits else ""
    types = ", ".join(record.request.candidates.sensors)
    if goal.coverage is not None:
        yield Paragraph(
            f"Find the cheapest sensors and positions that see {percent(goal.coverage)} of the road{with_limits}."
        )
    else:
        what = "see most of the road" if record.returns is None else "receive most returns from road users"
        yield Paragraph(f"Find the positions of sensors that {what}{with_limits}.")
    rules = [
        f"Sensor types to choose from: {types}.",
        (
            f"Positions to choose from: {counts.positions:,}, of which {counts.positions_on_poles:,} are on existing "
            f"poles; with all heights, types and directions {counts.poses:,} candidates."
        ),
    ]
    if goal.weighted:
        rules.append("The road in weighted regions has a higher weight.")
    if goal.min_distance > 0:
        rules.append(f"Sensors are at least {goal.min_distance:g} m apart.")
    rules += [_sentence(note) for note in record.notes if note.startswith(CHOSEN_FOR)]
    rules += [f"There must be a sensor at {name}." for name in goal.mandatory]
    rules += [f"There must be no sensor at {name}." for name in goal.forbidden]
    yield Bullets(tuple(rules))


def _site(evidence: Evidence) -> Iterator[Block]:
    record, targets = evidence.record, evidence.site.targets
    yield Paragraph(
        f"The region of interest is evaluated in {len(targets):,} squares of {targets.spacing:g} m, "
        f"{len(targets) * evidence.cell:,.0f} m² of road together. {_origin(evidence)}"
    )
    if record.site.sources:
        heading, *rows = source_table(record.site.sources)
        yield Paragraph("Sources of the objects in the scene, with the number whose position or height is assumed:")
        yield Table(heading, tuple(rows), frozenset({2, 3, 4}))
    if record.site.attribution:
        yield Paragraph(f"Data: {'; '.join(record.site.attribution)}.")
    obstacle = evidence.geo_reference.obstacle
    if obstacle:
        yield Paragraph(f"There are no latitudes and longitudes: {obstacle}.")
    else:
        yield Paragraph(
            f"Eastings and northings are coordinates of the map's projection, “{_projection(evidence)}”; latitudes and "
            "longitudes are on WGS 84."
        )
    if "view.png" in evidence.pictures:
        yield Picture(evidence.pictures["view.png"], "The site with the sensors and their coverage.")


def _origin(evidence: Evidence) -> str:
    origin = np.array(evidence.record.site.origin_m)
    if evidence.geo_reference.obstacle:
        x, y, z = origin
        return f"The scene's origin is at ({x:,.2f}, {y:,.2f}, {z:,.2f}) in map coordinates, metres."
    easting, northing, height = evidence.geo_reference.projected(origin)
    return f"The scene's origin is at easting {easting:,.2f} m, northing {northing:,.2f} m, height {height:,.2f} m."


def _projection(evidence: Evidence) -> str:
    known = evidence.record.site.geo_reference
    return "" if known is None else known.projection


def _sensors(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    price = "Installed price, $" if record.installed else "Price, $"
    head = ("", "Type", "Position", "Height, m", "Tilt, °", "Direction, °", price)
    rows = [
        (
            sensor.id,
            sensor.sensor_name,
            f"{sensor.position} ({'existing pole' if sensor.on_pole else 'new post'})"
            if sensor.pose is not None
            else sensor.position,
            f"{sensor.height_m:.2f}",
            f"{sensor.tilt_deg:.1f}",
            f"{sensor.yaw_deg:.1f}",
            f"{sensor.price_usd:,.0f}",
        )
        for sensor in record.sensors
    ]
    yield Table(head, tuple(rows), frozenset({3, 4, 5, 6}))
    yield Paragraph(
        f"Together {record.price_text}. Height is that of the optical centre above the ground; tilt is "
        "the downward angle of the sensor's front, direction its heading, counter-clockwise from the map's x axis."
    )
    if record.installed:
        total = sum(sensor.installation_usd or 0.0 for sensor in record.sensors)
        yield Paragraph(
            f"Prices include installation: {_dollars(total)} for posts, mounting, power and backhaul, "
            "from the table of installed costs under “Reproduction”."
        )
    else:
        yield Paragraph("Prices are for sensors only, without posts, mounting, power and backhaul.")
    types = {sensor.sensor_name: sensor.evidence for sensor in record.sensors if sensor.evidence}
    if types:
        yield Paragraph("Evidence for the detection range of each type:")
        yield Bullets(tuple(f"{name}: {rests_on}." for name, rests_on in types.items()))
    yield _coordinates(evidence)
    if not evidence.geo_reference.obstacle:
        yield Paragraph("Height in this table is that of the optical centre above the map's zero.")


def _coordinates(evidence: Evidence) -> Table:
    """Return the table of the sensors' optical centres."""
    head, rows = _located(evidence, np.array([sensor.map_m for sensor in evidence.sensors]), 3, 8)
    named = tuple((sensor.id, *row) for sensor, row in zip(evidence.sensors, rows, strict=True))
    return Table(("", *head), named, frozenset(range(1, 1 + len(head))))


def _located(evidence: Evidence, points: Float, metres: int, degrees: int) -> tuple[Row, list[Row]]:
    """Return heads and cells of a table of positions.

    Positions are projected and geographic coordinates where the map's projection is known, otherwise map coordinates.

    Parameters
    ----------
    points : (n, 3) float64, metres
        Map coordinates.
    metres, degrees : int
        Decimals of each.
    """
    points = points.reshape(-1, 3)
    places = evidence.geo_reference.geographic(points)
    if places is None:
        return ("Map x, m", "Map y, m", "Map z, m"), [tuple(f"{value:.{metres}f}" for value in row) for row in points]
    rows = [
        (*(f"{value:.{metres}f}" for value in projected), f"{latitude:.{degrees}f}", f"{longitude:.{degrees}f}")
        for projected, (longitude, latitude, _) in zip(evidence.geo_reference.projected(points), places, strict=True)
    ]
    return ("Easting, m", "Northing, m", "Height, m", "Latitude, °", "Longitude, °"), rows


def _coverage(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    coverage = record.coverage
    lines = [
        f"{percent(coverage.whole)} of the road is seen by a sensor, {percent(coverage.seen_twice)} by two or more."
    ]
    lines += [_sentence(note) for note in record.notes if note.startswith((BAND, UNRANKED))]
    if coverage.central is not None:
        lines.append(f"{percent(coverage.central)} of the weighted regions is seen.")
    yield Bullets(tuple(lines))
    if "plan.png" in evidence.pictures:
        yield Picture(evidence.pictures["plan.png"], "Coverage map with the sensor positions.")
    yield Table(
        ("", "Sees of the road", "Sees alone"),
        tuple((one.id, percent(one.coverage_alone), percent(one.coverage_marginal)) for one in record.sensors),
        frozenset({1, 2}),
    )
    places = seen_places(evidence.site.targets, evidence.seen_by, evidence.site.areas)
    yield Table(
        ("Place", "Road, m²", "Seen", "Seen twice"),
        tuple((one.name, f"{one.area:,.0f}", percent(one.seen), percent(one.seen_twice)) for one in places),
        frozenset({1, 2, 3}),
    )


def _blind_spots(evidence: Evidence) -> Iterator[Block]:
    targets = evidence.site.targets
    spots = blind_spots(targets, evidence.seen, evidence.site.areas)
    if not spots:
        yield Paragraph("There are none: every square of the road is seen.")
        return
    area = sum(spot.area for spot in spots)
    shown = spots[:MOST_SPOTS]
    largest = "" if len(shown) == len(spots) else f" The {len(shown)} largest are listed."
    parts = counted(len(spots), "connected part")
    yield Paragraph(f"{area:,.0f} m² of road is not seen, in {parts}.{largest} {_counted_from(evidence)}")
    yield Picture(
        blind_spot_map(evidence, shown),
        "Orange is not seen, light blue seen by one sensor, dark blue by two or more; triangles are sensors, numbers "
        "the blind spots of the table. The map's y axis points up.",
    )
    middles = np.array([spot.middle for spot in shown]) + np.array(evidence.record.site.origin_m)
    yield _spot_table(evidence, shown, middles)


def _counted_from(evidence: Evidence) -> str:
    """Return the sentence that defines distances and directions of blind spots."""
    origins = centres(evidence.site.targets, evidence.site.areas)
    names = [f"“{centre.name}”" for centre in origins]
    if not evidence.site.targets.central.any():
        origin = "the centre of the road, the mean of all its squares"
    elif len(names) == 1:
        origin = f"the centre of the weighted region {names[0]}"
    else:
        origin = f"the nearest centre of a weighted region ({', '.join(names)})"
    return f"Distances and directions are counted from {origin}; north is the direction of the map's y axis."


def _spot_table(evidence: Evidence, spots: Sequence[BlindSpot], middles: Float) -> Table:
    head, rows = _located(evidence, middles, 1, 6)
    cells = tuple(
        (str(number), f"{spot.area:,.0f}", spot.where, *row)
        for number, (spot, row) in enumerate(zip(spots, rows, strict=True), start=1)
    )
    return Table(("", "Area, m²", "Where", *head), cells, frozenset({1, *range(3, 3 + len(head))}))


def _certificate(evidence: Evidence, points: Sequence[FrontPoint]) -> Iterator[Block]:
    record = evidence.record
    yield Paragraph(certificate_sentence(evidence))
    same_price = _same_price(evidence, points)
    elsewhere = (POSE_ERRORS, CHOSEN_FOR, BAND, UNRANKED, *LOCATED_FILES, *([SAME_PRICE] if same_price else []))
    notes = [_sentence(note) for note in record.notes if not note.startswith(elsewhere)]
    notes += [same_price] if same_price else []
    if record.greedy is not None:
        lost = record.greedy.gap_to_placement
        notes.append(
            "A greedy choice of one sensor after the other gives "
            f"{f'{lost:.2%}' if lost > 0 else 'no'} {'less' if record.returns is None else 'fewer returns'}."
        )
    notes.append("“Proven” refers to the model: this scene, these sensor models and this definition of seen.")
    yield Bullets(tuple(notes))


def _same_price(evidence: Evidence, points: Sequence[FrontPoint]) -> str:
    """Return what is proven of the coverage of the cheapest placement, from the table of numbers of sensors, or ""."""
    record, problem = evidence.record, evidence.site.problem
    own = [point for point in points if point.count == len(record.sensors)]
    if not record.objective.cheapest or record.objective.status == MOVED or not own or not equal_prices(problem):
        return ""
    choice = f"choice of {counted(len(record.sensors), 'sensor')}, at the same price,"
    more = own[0].coverage - _weighted_share(evidence)
    if more > MIN_DIFFERENCE:
        return f"Another {choice} covers {_points(more)} more: see “Fewer or more sensors”."
    missed = own[0].missed
    return f"No other {choice} covers more{f' than {_points(missed)} more' if missed else ': this is proven'}."


def _weighted_share(evidence: Evidence) -> float:
    """Return the share of the road that is seen, counted by its weights."""
    weights = evidence.site.problem.weights
    return math.fsum(weights[evidence.seen]) / math.fsum(weights)


def _losses(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    failed = failures(evidence.site.seen)
    if failed is not None:
        worst = record.sensors[failed.left.index(failed.worst)].id
        yield Paragraph(
            f"After the failure of one sensor, {percent(failed.mean)} of the road is still seen on average, and "
            f"{percent(failed.worst)} in the worst case, the failure of {worst}."
        )
        yield Table(
            ("Failed", "Still seen", "Lost"),
            tuple(
                (sensor.id, percent(left), percent(max(0.0, record.coverage.whole - left)))
                for sensor, left in zip(record.sensors, failed.left, strict=True)
            ),
            frozenset({1, 2}),
        )
    errors = [_sentence(note) for note in record.notes if note.startswith(POSE_ERRORS)]
    scenarios = record.request.goal.scenarios
    if not errors and not scenarios.errs:
        errors = ["The loss from errors of the sensors' poses was not evaluated (option --pose-errors)."]
    if scenarios.kind != "traffic":
        errors.append("The road is empty: occlusion by vehicles was not evaluated (option --traffic).")
    if errors:
        yield Bullets(tuple(errors))
    for name in (*POSE_ERROR_PICTURES, *TRAFFIC_PICTURES):
        if name in evidence.pictures:
            yield Picture(evidence.pictures[name], CAPTIONS[name])


def _front(evidence: Evidence, points: Sequence[FrontPoint]) -> Iterator[Block]:
    if not points:
        why = (
            "the folder does not hold the visibility grid of this placement"
            if evidence.grid is None
            else "it was not requested"
        )
        yield Paragraph(f"Other numbers of sensors were not evaluated: {why}.")
        return
    record = evidence.record
    weighted = " Coverage is weighted here." if np.ptp(evidence.site.problem.weights) > 0 else ""
    budget = record.request.goal.budget
    limit = "" if budget is None else f" The budget of {_dollars(budget)} does not limit the choices of this table."
    yield Paragraph(
        f"For each number of sensors, the placement with most coverage under the same rules, regardless of "
        f"price.{limit}{weighted} The last column gives the proven bound on the coverage of all other placements of at "
        "most that number. Searches for other numbers start from this placement and are limited."
    )
    goal = purpose(record.notes)
    if goal:
        yield Paragraph(f"This placement was chosen{goal}, not for coverage: the table does not rank it.")
    price = "Installed price, $" if record.installed else "Price, $"
    yield Picture(
        front_chart(points, (record.price_usd, _weighted_share(evidence)), installed=record.installed),
        "Coverage against price by number of sensors; a line above a point extends to its proven bound.",
    )
    rows = tuple(
        (
            str(point.count),
            f"{point.price:,.0f}",
            percent(point.coverage),
            "none covers more" if point.missed == 0 else f"at most {_points(point.missed)} more",
        )
        for point in points
    )
    yield Table(("Sensors", price, "Coverage", "Other choices"), rows, frozenset({0, 1, 2}))


def _warnings(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    chosen = (sensor.sensor for sensor in record.sensors)
    warnings = relevant_warnings(record.warnings, record.request.candidates.sensors, chosen)
    standing = (
        "A square is seen if a return of the sensor's scan lies near its centre. The scene is a model: objects that it "
        "lacks do not occlude. Check positions on site for ownership, foundations, power and lines."
    )
    yield Bullets((*(_sentence(warning) for warning in warnings), standing))


def _making(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    command = repeating_command(record)
    if command:
        yield Paragraph("This command, run in the result folder, repeats the placement in another folder:")
        yield Code(command)
    else:
        yield Paragraph("No single command repeats this placement; its settings are below.")
    versions = ", ".join(f"{name} {version}" for name, version in record.versions.items())
    yield Paragraph(f"Made {record.times.created} with {versions}; solver {record.objective.solver}.")
    settings = ((name, json.dumps(value, ensure_ascii=False)) for name, value in record.settings.items())
    inputs = ((f"digest of {name}", value) for name, value in record.inputs.items())
    yield Table(("Setting", "Value"), (*settings, *inputs))


def _sentence(text: str) -> str:
    """Return a note with a capital and a full stop; names of types and files at its beginning stay as they are."""
    first = text.split(maxsplit=1)[0] if text.strip() else ""
    begun = text[:1].upper() + text[1:] if first.isalpha() else text
    return begun if begun.endswith((".", "!", "?")) else f"{begun}."


def _dollars(amount: float) -> str:
    return f"${amount:,.0f}"


def _points(share: float) -> str:
    """Return a share as percentage points, rounded up."""
    return f"{math.ceil(share * 1000 - 1e-9) / 10:.1f} percentage points"
