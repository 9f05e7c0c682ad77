"""The sections of a report, in words that a city engineer reads."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..arrays import Float
from ..pictures.drawing import percent
from ..placement.objective import CHOSEN_FOR, MOVED, MOVED_MESSAGE
from ..results.located import LOCATED_FILES
from ..results.placement_record import RecordedObjective, RecordedSensor, relevant_warnings
from ..site.sources import source_table
from .blind_spots import BlindSpot, blind_spots, seen_places
from .blocks import Block, Bullets, Code, Paragraph, Picture, Report, Section, Table
from .evidence import ROBUST_PICTURES, TRAFFIC_PICTURES, Evidence
from .figures import blind_spot_map, front_chart
from .losses import FrontPoint, failures
from .repeat import repeating_command

MOST_SPOTS = 8
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
        Section("The question", tuple(_question(evidence))),
        Section("The site", tuple(_site(evidence))),
        Section("The sensors", tuple(_sensors(evidence))),
        Section("What they see", tuple(_coverage(evidence))),
        Section("Blind spots", tuple(_blind_spots(evidence))),
        Section("How good this answer is", tuple(_certificate(evidence))),
        Section("What can go wrong", tuple(_losses(evidence))),
        Section("Fewer or more sensors", tuple(_front(evidence, points))),
        Section("What to know before trusting the figures", tuple(_warnings(evidence))),
        Section("How it was made", tuple(_making(evidence))),
    )
    coverage = record.coverage
    central = "" if coverage.central is None else f", {percent(coverage.central)} of its weighted part"
    summary = (
        f"{_count(len(record.sensors), 'sensor')} {'sees' if len(record.sensors) == 1 else 'see'} "
        f"{percent(coverage.whole)} of the road{central}, for {_dollars(record.price_usd)}."
    )
    return Report(record.site.name, summary, record.times.created, sections)


def certificate_sentence(evidence: Evidence) -> str:
    """Say how good the placement provably is, against every other choice among the same places."""
    found, places = evidence.record.objective, evidence.record.counts.positions
    if found.status == MOVED:
        return MOVED_MESSAGE
    if any(note.startswith(CHOSEN_FOR) for note in evidence.record.notes):
        return found.certificate
    choice = f"choice among the {places:,} places where a sensor may hang that keeps to the same rules"
    if found.bound is None:
        return f"Another {choice} may be better; how much better is not known."
    better = _cheaper(found) if found.cheapest else _more_coverage(evidence)
    proven = "this is proven" if found.status == "optimal" else "this much is proven, and no more was found out"
    return f"No other {choice} {better}: {proven}."


def _cheaper(found: RecordedObjective) -> str:
    if found.status == "optimal" or found.bound is None:
        return "reaches the coverage that was asked for at a lower price"
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
    goal, counts = record.asked.goal, record.counts
    limits = [] if goal.count is None else [f"at most {_count(goal.count, 'sensor')}"]
    limits += [] if goal.budget is None else [f"at most {_dollars(goal.budget)}"]
    with_limits = f", with {' and '.join(limits)}" if limits else ""
    types = ", ".join(record.asked.candidates.sensors)
    if goal.coverage is not None:
        yield Paragraph(
            f"Which sensors see {percent(goal.coverage)} of the road at the least price{with_limits}, and where do "
            "they hang?"
        )
    else:
        yield Paragraph(f"Where must sensors hang to see as much as possible of the road{with_limits}?")
    rules = [
        f"Sensor types to choose from: {types}.",
        (
            f"Places to choose from: {counts.positions:,}, of which {counts.positions_on_poles:,} are on existing "
            f"poles; with all heights, types and directions {counts.poses:,} candidates."
        ),
    ]
    if goal.weighted:
        rules.append("The road in weighted regions counts for more than the rest.")
    if goal.min_distance > 0:
        rules.append(f"Sensors are at least {goal.min_distance:g} m apart.")
    rules += [_sentence(note) for note in record.notes if note.startswith(CHOSEN_FOR)]
    rules += [f"There must be a sensor at {name}." for name in goal.mandatory]
    rules += [f"There must be no sensor at {name}." for name in goal.forbidden]
    yield Bullets(tuple(rules))


def _site(evidence: Evidence) -> Iterator[Block]:
    record, targets = evidence.record, evidence.site.targets
    x, y, z = record.site.origin_m
    yield Paragraph(
        f"The region of interest is {len(targets) * evidence.cell:,.0f} m² of road, looked at in "
        f"{len(targets):,} squares of {targets.spacing:g} m. Map coordinates are metres; the scene has its origin at "
        f"map ({x:,.2f}, {y:,.2f}, {z:,.2f})."
    )
    if record.site.sources:
        heading, *rows = source_table(record.site.sources)
        yield Paragraph("Where the objects of the scene come from, and for how many place or height is assumed:")
        yield Table(heading, tuple(rows), frozenset({2, 3, 4}))
    obstacle = evidence.geo_reference.obstacle
    if obstacle:
        yield Paragraph(f"There are no latitudes and longitudes: {obstacle}.")
    else:
        yield Paragraph(f"Latitudes and longitudes are on WGS 84, by the map's projection “{_projection(evidence)}”.")
    if "view.png" in evidence.pictures:
        yield Picture(evidence.pictures["view.png"], "The site with the sensors and what they see.")


def _projection(evidence: Evidence) -> str:
    known = evidence.record.site.geo_reference
    return "" if known is None else known.projection


def _sensors(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    installed = any(sensor.installation_usd is not None for sensor in record.sensors)
    head = ("", "Type", "Place", "Height, m", "Tilt, °", "Direction, °", "Price, $")
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
        f"Together {_dollars(record.price_usd)}. Height is that of the optical centre above the ground; tilt is how "
        "far the sensor's front looks down, direction where it points, counter-clockwise from the map's x axis."
    )
    if installed:
        total = sum(sensor.installation_usd or 0.0 for sensor in record.sensors)
        yield Paragraph(
            f"Prices are of installed sensors: {_dollars(total)} of them is for posts, mounting, power and backhaul, "
            "by the table of installed costs under “How it was made”."
        )
    else:
        yield Paragraph("Prices are of the sensors alone: posts, mounting, power and backhaul are not counted.")
    yield _coordinates(record.sensors)
    if not evidence.geo_reference.obstacle:
        yield Paragraph("Altitude is the height of the optical centre above the map's zero.")


def _coordinates(sensors: Sequence[RecordedSensor]) -> Table:
    """Return the table of where the optical centres are."""
    rows = [(sensor.id, *(f"{value:.3f}" for value in sensor.map_m), *_degrees(sensor)) for sensor in sensors]
    head = ("", "Map x, m", "Map y, m", "Map z, m", "Latitude, °", "Longitude, °", "Altitude, m")
    return Table(head[: max(map(len, rows), default=1)], tuple(rows), frozenset(range(1, 7)))


def _degrees(sensor: RecordedSensor) -> tuple[str, ...]:
    """Return latitude, longitude and altitude of a sensor; nothing where they are not known."""
    if sensor.latitude_deg is None or sensor.longitude_deg is None or sensor.altitude_m is None:
        return ()
    return f"{sensor.latitude_deg:.8f}", f"{sensor.longitude_deg:.8f}", f"{sensor.altitude_m:.2f}"


def _coverage(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    coverage = record.coverage
    lines = [
        f"{percent(coverage.whole)} of the road is seen by a sensor, {percent(coverage.seen_twice)} by two or more."
    ]
    if coverage.central is not None:
        lines.append(f"{percent(coverage.central)} of the weighted regions is seen.")
    yield Bullets(tuple(lines))
    if "plan.png" in evidence.pictures:
        yield Picture(evidence.pictures["plan.png"], "Coverage map: what is seen, what is not, and where sensors hang.")
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
    parts = _count(len(spots), "connected part")
    yield Paragraph(f"{area:,.0f} m² of road is not seen, in {parts}.{largest}")
    yield Picture(
        blind_spot_map(evidence, shown),
        "Orange is not seen, light blue seen by one sensor, dark blue by two or more; triangles are sensors, numbers "
        "the blind spots of the table. North, or the map's y axis, is up.",
    )
    middles = np.array([spot.middle for spot in shown]) + np.array(evidence.record.site.origin_m)
    yield _spot_table(evidence, shown, middles)


def _spot_table(evidence: Evidence, spots: Sequence[BlindSpot], middles: Float) -> Table:
    places = evidence.geo_reference.geographic(middles)
    rows = []
    for number, (spot, middle) in enumerate(zip(spots, middles, strict=True)):
        located = () if places is None else tuple(f"{places[number, axis]:.6f}" for axis in (1, 0))
        plan = tuple(f"{value:.1f}" for value in middle[:2])
        rows.append((str(number + 1), f"{spot.area:,.0f}", spot.where, *plan, *located))
    head = ("", "Area, m²", "Where", "Map x, m", "Map y, m", "Latitude, °", "Longitude, °")
    return Table(head[: len(rows[0])], tuple(rows), frozenset({1, 3, 4, 5, 6}))


def _certificate(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    yield Paragraph(certificate_sentence(evidence))
    elsewhere = (POSE_ERRORS, CHOSEN_FOR, *LOCATED_FILES)
    notes = [_sentence(note) for note in record.notes if not note.startswith(elsewhere)]
    if record.greedy is not None:
        lost = record.greedy.gap_to_placement
        notes.append(
            "Choosing one sensor after the other, each the best at the time, gives "
            f"{f'{lost:.2%} less' if lost > 0 else 'no less'}."
        )
    notes.append("“Proven” is said of the model: of this scene, these sensors and this rule of what counts as seen.")
    yield Bullets(tuple(notes))


def _losses(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    failed = failures(evidence.site.seen)
    if failed is not None:
        worst = record.sensors[failed.left.index(failed.worst)].id
        yield Paragraph(
            f"When one sensor fails, {percent(failed.mean)} of the road is still seen on average, and "
            f"{percent(failed.worst)} in the worst case, the failure of {worst}. This is counted square by square."
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
    if not errors and "robustness" not in record.settings:
        errors = ["What is lost where sensors do not hang quite as planned was not evaluated (option --pose-errors)."]
    if "traffic" not in record.settings:
        errors.append("The road is empty: what vehicles hide was not evaluated (command seip in-traffic).")
    if errors:
        yield Bullets(tuple(errors))
    for name in (*ROBUST_PICTURES, *TRAFFIC_PICTURES):
        if name in evidence.pictures:
            yield Picture(evidence.pictures[name], CAPTIONS[name])


def _front(evidence: Evidence, points: Sequence[FrontPoint]) -> Iterator[Block]:
    if not points:
        why = (
            "the folder does not hold the visibility grid of this placement"
            if evidence.grid is None
            else "it was not asked for"
        )
        yield Paragraph(f"Other numbers of sensors were not looked at: {why}.")
        return
    weights = evidence.site.problem.weights
    share = math.fsum(weights[evidence.seen]) / math.fsum(weights)
    weighted = " Coverage counts the road by its weights here." if float(np.ptp(weights)) > 0 else ""
    yield Paragraph(
        "The choice of one sensor, of two, and so on, that sees most under the same rules, whatever it costs: a search "
        f"with a budget may find more for the money. Each was searched for a limited time only.{weighted}"
    )
    yield Picture(
        front_chart(points, (evidence.record.price_usd, share)),
        "Coverage against price by number of sensors; a line above a point reaches to what could not be ruled out.",
    )
    rows = tuple(
        (
            str(point.count),
            f"{point.price:,.0f}",
            percent(point.coverage),
            "proven the best" if point.missed == 0 else f"at most {_points(point.missed)} more",
        )
        for point in points
    )
    yield Table(("Sensors", "Price, $", "Coverage", "Another choice"), rows, frozenset({0, 1, 2}))


def _warnings(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    chosen = (sensor.sensor for sensor in record.sensors)
    warnings = relevant_warnings(record.warnings, record.asked.candidates.sensors, chosen)
    standing = (
        "A square counts as seen when a return of the sensor's scan lies near its middle. The scene is a model: what "
        "is not in it hides nothing. Check positions on site for ownership, foundations, power and lines."
    )
    yield Bullets((*(_sentence(warning) for warning in warnings), standing))


def _making(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    command = repeating_command(record)
    if command:
        yield Paragraph("In the folder of the result this repeats it, and writes to another folder:")
        yield Code(command)
    else:
        yield Paragraph("No single command makes this placement again; its settings are below.")
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


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'s' * (number != 1)}"


def _dollars(amount: float) -> str:
    return f"${amount:,.0f}"


def _points(share: float) -> str:
    """Return a share as percentage points, rounded up."""
    return f"{math.ceil(share * 1000 - 1e-9) / 10:.1f} percentage points"
