"""The pages of a report, in words that a city engineer reads."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...base.arrays import Boolean, Float
from ...base.counts import counted
from ...base.progress import Progress
from ...choosing.placement.deployment import BAND, UNRANKED
from ...choosing.placement.objective import CHOSEN_FOR, Objective, purpose
from ...choosing.placement.returns_summary import (
    FEW,
    FEW_RETURNS,
    NOT_BY_DETECTION,
    SURFACE_SEEN,
    returns_text,
)
from ...sensing.lidar.catalogue import load_catalogue
from ...site.candidates import PAPER_TYPES
from ..pictures.drawing import percent
from ..results.answer import Costs, costs_of, date, dollars, outlook, sentence
from ..results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURE
from ..results.geographic_files import LOCATED_FILES
from ..results.placement_record import RecordedSensor, relevant_warnings
from ..results.verification_record import (
    LEAST_COST,
    RecordedChange,
    change_text,
    cost_text,
    coverage_text,
    gain_text,
    objects,
    pose_text,
    vehicles,
)
from .blind_spots import blind_spot_map, blind_spots, centres, seen_places, seen_streets
from .blocks import (
    Block,
    Bullets,
    Card,
    Facts,
    Paragraph,
    Picture,
    Report,
    Table,
    make_sections,
)
from .evidence import Evidence, load_evidence
from .pdf import save_report

MOST_SPOTS = 8
LEAST_TILT = 0.05  # degrees, below which a sensor is upright
FOR_RETURNS = " for returns from road users"
POSE_ERRORS = "with errors of"
"""Beginning of the note on the cost of pose errors."""
CAPTIONS = {
    "spread.png": "Coverage over draws of pose errors that were not used for choosing.",
    "blame.png": "What each sensor's errors, and each kind of error, cost on average.",
    "time_seen.png": "For which share of the time each part of the road is seen in traffic.",
}
COST_SOURCES = (
    "Installation costs: Florida DOT in the ITS Costs Database of the US DOT (2004) for posts, arms and power; AASHTO, "
    "National Connected Vehicle Field Infrastructure Footprint Analysis, FHWA-JPO-14-125 (2014), for data lines; "
    "mounting on an existing pole is an assumption. Replace them by your own contract prices."
)
PAPER_MODELS = (
    "are the sensor models of the SEIP study on roadside perception, not products: they stand for LiDARs with 16, 32 "
    "and 128 channels, and count every return within range. Choose a product and place the sensors again before "
    "inviting tenders."
)


def make_report(evidence: Evidence) -> Report:
    """Return the report on a placement."""
    record = evidence.record
    costs = costs_of(record)
    contents = {
        "Plan": _plan(evidence),
        "Verification of the installation": _verification(evidence),
        "Sensors": _sensors(evidence, costs),
        "Costs": _costs(costs),
        "Streets and crossings": _places(evidence),
        "Blind spots": _blind_spots(evidence),
        "Other choices": _other_choices(evidence),
        "Failures and errors": _losses(evidence),
        "How far the figures can be trusted": _trust(evidence),
        "Sources": _sources(evidence),
        "Reproduction": [Facts(tuple(_settings(evidence)))],
    }
    subtitle = f"Positions of roadside LiDAR sensors, {date(record.times.created)}"
    first = tuple(_first_page(evidence, costs))
    return Report(record.site.name, subtitle, record.times.created, first, make_sections(contents))


def write_report(folder: Path) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write ``report.html`` and ``report.pdf`` into the folder of a result; the same folder gives the same bytes.

    Raises
    ------
    SeipError
        The folder holds no result, or a damaged one, or cannot be written.
    """
    yield Progress(0, 0, "reading the result")
    evidence = load_evidence(folder)
    yield Progress(0, 0, "setting the report")
    return save_report(folder, make_report(evidence))


def _first_page(evidence: Evidence, costs: Costs) -> Iterator[Block]:
    record, sensors = evidence.record, evidence.record.sensors
    (place,) = _located(evidence, np.array(record.site.origin_m)[None], 5)
    types = Counter(sensor.sensor_name for sensor in sensors)
    on_poles = sum(sensor.on_pole for sensor in sensors)
    kinds = (
        (on_poles, "on an existing pole", "on existing poles"),
        (len(sensors) - on_poles, "on a new post", "on new posts"),
    )
    mounted = ", ".join(f"{number} {one if number == 1 else several}" for number, one, several in kinds if number)
    parts = f"{dollars(costs.sensors)} sensors, {dollars(costs.total - costs.sensors)} installation"
    coverage, returns = record.coverage, record.returns
    seen = f"{percent(coverage.whole)} of the road is seen, {percent(coverage.seen_twice)} by two or more sensors"
    if returns is not None:
        on_foot = returns_text(returns.of_each["pedestrian"])
        seen = f"about {on_foot} points on a pedestrian in each revolution; {seen}"
    rows = (
        ("Where", record.site.name if evidence.geo_reference.obstacle else f"{record.site.name}, {place}"),
        ("What", ", ".join(f"{number} × {name}" for name, number in types.items()) or "no sensors"),
        ("How many", f"{counted(len(sensors), 'sensor')}{': ' if mounted else ''}{mounted}"),
        ("Price", f"{'about ' if costs.estimated else ''}{dollars(costs.total)} installed ({parts})"),
        ("Quality", seen),
    )
    yield Facts(rows, large=True)
    name = next((name for name in ("view.png", "plan.png") if name in evidence.pictures), None)
    if name is not None:
        yield Picture(evidence.pictures[name], "The site with the sensors and what they see.")
    yield Paragraph(_summary(evidence))


def _summary(evidence: Evidence) -> str:
    """Return the paragraph of the first page."""
    record, coverage = evidence.record, evidence.record.coverage
    together = counted(len(record.sensors), "LiDAR sensor sees", "LiDAR sensors see")
    seen = f"{together} {percent(coverage.whole)} of the {evidence.area:,.0f} m² of road studied here"
    band = coverage.gain_band
    if band is not None and band.sheets:
        span = f"{percent(band.low)} to {percent(band.high)}"
        seen += f" ({span}, as the sensors' range is only known from data sheets)"
    parts = [f"{seen}."]
    if coverage.central is not None:
        names = ", ".join(name for name, _ in centres(evidence.site.targets, evidence.site.areas))
        parts.append(f"Of the most important part ({names}), {percent(coverage.central)} is seen.")
    if record.returns is not None:
        parts += filter(None, [record.returns.verdict()])
        *others, last = (
            f"{returns_text(number)} points on a {name}" for name, number in record.returns.of_each.items()
        )
        measure = "it typically measures" if len(record.sensors) == 1 else "they typically measure"
        parts.append(
            f"In each revolution {measure} {', '.join(others)} and {last}, with an allowance for traffic in between."
        )
    least = min(record.crossings, key=lambda one: one.least, default=None)
    if least is not None:
        name = f"c{least.name[1:]}" if least.name.startswith("Crossing") else least.name  # within a sentence
        parts.append(
            f"A pedestrian in plain view on a crossing returns at least {returns_text(least.least)} points in each "
            f"revolution (at the worst point of the {name})."
        )
    if len(record.sensors) > 1:
        least_left = percent(min(after_failures(evidence.site.seen)))
        parts.append(f"If any one sensor fails, at least {least_left} of the road is still seen.")
    return " ".join([*parts, outlook(record)])


def _plan(evidence: Evidence) -> Iterator[Block]:
    if "plan.png" in evidence.pictures and "view.png" in evidence.pictures:
        yield Picture(evidence.pictures["plan.png"], "Plan with the sensors and what they see; north is up.", tall=True)


def _verification(evidence: Evidence) -> Iterator[Block]:
    found = evidence.verification
    if found is None:
        return
    steps = found.coverage
    yield Paragraph(
        f"The recording “{found.recording}” of the installed sensors was compared with the plan, beam by beam. "
        f"{coverage_text(steps)}"
    )
    planned = evidence.record.coverage.whole
    differs = f" Settings other than those of the placement, which promised {percent(planned)}, were used."
    yield Paragraph(
        "Each effect is on top of those before it, and all are computed on the same squares of road. In the recording "
        f"itself, {percent(steps.returned)} of the squares have a measured point nearby in most turns of the sensors."
        f"{'' if abs(steps.promised - planned) < LEAST_COST else differs}"
    )
    missing = [sensor.id for sensor in evidence.record.sensors if sensor.id not in {one.id for one in found.sensors}]
    if missing:
        yield Paragraph(f"The recording does not contain {', '.join(missing)}: the coverage above is without.")
    for one in found.sensors:
        lines = (pose_text(one), gain_text(one))
        yield Card(f"{one.id} as installed", tuple(Paragraph(line) for line in lines if line))
    yield from _changes(evidence, objects(found))
    standing = vehicles(found)
    if standing:
        stood = counted(standing, "standing vehicle is", "standing vehicles are")
        yield Paragraph(f"{stood} not counted as changes.")
    if "changes.png" in evidence.pictures:
        yield Picture(
            evidence.pictures["changes.png"],
            "The recording on the plan: grey is as planned, red is nearer than planned, blue is farther.",
            tall=True,
        )


def _changes(evidence: Evidence, changes: Sequence[RecordedChange]) -> Iterator[Block]:
    if not changes:
        yield Paragraph("No object has appeared or disappeared that the sensors could measure.")
        return
    middles = np.array([change.box[:3] for change in changes]) + np.array(evidence.record.site.origin_m)
    sizes = [" × ".join(f"{side:.1f}" for side in change.box[3:6]) for change in changes]
    rows = tuple(
        (f"{change.name}: {change_text(change)}", size, place, cost_text(change.coverage_cost))
        for change, size, place in zip(changes, sizes, _located(evidence, middles), strict=True)
    )
    yield Paragraph(
        "These objects differ from the plan. Sizes are of the parts that the sensors measure, and the last column is "
        "the coverage that each of them costs."
    )
    yield Table(("What", "Size, m", "Where", "Coverage"), rows)


def _sensors(evidence: Evidence, costs: Costs) -> Iterator[Block]:
    obstacle = evidence.geo_reference.obstacle
    zero = evidence.record.site.altitude_zero or "the zero of the map's heights"
    mercator = evidence.geo_reference.mercator
    zone = "" if mercator is None else mercator.zone
    projection = f"UTM zone {zone}" if zone else f"the projection “{evidence.geo_reference.projection}”"
    system = (
        f"There are no latitudes and longitudes: {obstacle}."
        if obstacle
        else f"Eastings and northings are coordinates of {projection}; latitudes and longitudes are on WGS 84; "
        f"altitudes count from {zero}."
    )
    yield Paragraph(
        f"Heights and coordinates are those of the optical centre. {system} Before work begins, check ownership, "
        "foundations, power and underground lines on site."
    )
    for sensor, items in zip(evidence.record.sensors, costs.items, strict=True):
        yield Card(f"{sensor.id}  {sensor.sensor_name}", (Facts(tuple(_sensor_facts(evidence, sensor, items))),))


def _sensor_facts(evidence: Evidence, sensor: RecordedSensor, items: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    if sensor.location:
        yield "Location", sensor.location
    yield "Mounted on", _mounting(sensor)
    tilted = abs(sensor.tilt_deg) >= LEAST_TILT
    tilt = f"tilted by {sensor.tilt_deg:.1f}° downwards at the front" if tilted else "upright (tilt 0°)"
    yield "Height, tilt", f"{sensor.height_m:.2f} m above the ground, {tilt}"
    if sensor.roll_deg:
        yield "Roll", f"{sensor.roll_deg:.1f}°"
    if not sensor.all_round or tilted:
        yield "Yaw", f"{sensor.yaw_deg:.1f}° counter-clockwise from the map's x axis (east)"
    if sensor.easting_m is None or sensor.northing_m is None:
        x, y, z = sensor.map_m
        yield "Map x, y, z", f"{x:.1f}, {y:.1f}, {z:.1f} m"
    else:
        yield "Easting, northing", f"{sensor.easting_m:.1f}, {sensor.northing_m:.1f} m"
        yield "Latitude, longitude", f"{sensor.latitude_deg:.6f}°, {sensor.longitude_deg:.6f}°"
        yield "Altitude", f"{sensor.altitude_m:.1f} m"
    parts = ", ".join(f"{name} {dollars(amount)}" for name, amount in items.items())
    yield "Cost", f"{dollars(sum(items.values()))}: {parts}"
    alone = f"; {percent(sensor.coverage_marginal)} is seen by no other" if len(evidence.record.sensors) > 1 else ""
    yield "Sees", f"{percent(sensor.coverage_alone)} of the road{alone}"


def _costs(costs: Costs) -> Iterator[Block]:
    rows = [(name[:1].upper() + name[1:], str(number), dollars(amount)) for name, number, amount in costs.by_item]
    yield Table(("Item", "Number", "Cost"), (*rows, ("Total", "", dollars(costs.total))), frozenset({1, 2}))
    yield Paragraph(COST_SOURCES)
    if costs.estimated:
        yield Paragraph(
            "The sensors were placed by their own prices, without installation. To choose by installed prices, place "
            "them again with installed costs."
        )


def _places(evidence: Evidence) -> Iterator[Block]:
    site, returns = evidence.site, {one.name: one.least for one in evidence.record.crossings}
    parts = seen_streets(site.targets, evidence.seen_by, [one for one in site.areas if one.name not in returns])
    streets = ((one.name, f"{one.area:,.0f}", percent(one.seen), percent(one.seen_twice)) for one in parts)
    yield Table(("Part of the road", "Area, m²", "Seen", "Twice"), tuple(streets), frozenset({1, 2, 3}))
    places = seen_places(site.targets, evidence.seen_by, [one for one in site.areas if one.name in returns])
    crossings = tuple((one.name, percent(one.seen), returns_text(returns[one.name])) for one in places)
    if crossings:
        yield Table(("Crossing", "Surface seen", "Points on a pedestrian"), crossings, frozenset({1, 2}))
        yield Paragraph(
            "Points on a pedestrian are those that all sensors together measure in one revolution on a pedestrian in "
            "plain view, at the worst point of the crossing. "
            f"With fewer than {FEW_RETURNS:g} a detector may miss the pedestrian."
        )
        few = [name for name, _, _ in crossings if returns[name] < FEW_RETURNS]
        if few:
            yield Paragraph(f"Fewer than {FEW_RETURNS:g}: {', '.join(few)}.")


def _blind_spots(evidence: Evidence) -> Iterator[Block]:
    spots = blind_spots(evidence.site.targets, evidence.seen_by > 0, evidence.site.areas)
    if not spots:
        yield Paragraph("There are none: every square of the road is seen.")
        return
    area = sum(spot.area for spot in spots)
    shown = spots[:MOST_SPOTS]
    largest = "" if len(shown) == len(spots) else f" The {len(shown)} largest are listed."
    parts = counted(len(spots), "connected part")
    yield Paragraph(f"{area:,.0f} m² of road is not seen, in {parts}.{largest} {_counted_from(evidence)}")
    if evidence.record.returns is not None:
        yield Paragraph(SURFACE_SEEN)
    yield Picture(
        blind_spot_map(
            evidence.site.targets, evidence.seen_by, shown, evidence.record.sensors, evidence.record.site.attribution
        ),
        "Orange is not seen, light blue seen by one sensor, dark blue by two or more. Triangles are sensors, numbers "
        "the blind spots of the table.",
    )
    middles = np.array([spot.middle for spot in shown]) + np.array(evidence.record.site.origin_m)
    rows = tuple(
        (str(number), f"{spot.area:,.0f}", f"{spot.where} ({place})")
        for number, (spot, place) in enumerate(zip(shown, _located(evidence, middles), strict=True), start=1)
    )
    yield Table(("", "Area, m²", "Where"), rows, frozenset({1}))


def _counted_from(evidence: Evidence) -> str:
    """Return the sentence that defines distances and directions of blind spots."""
    names = [f"“{name}”" for name, _ in centres(evidence.site.targets, evidence.site.areas)]
    if not evidence.site.targets.central.any():
        origin = "the centre of the road, the mean of all its squares"
    elif len(names) == 1:
        origin = f"the centre of {names[0]}"
    else:
        origin = f"the nearest of the centres of {', '.join(names)}"
    return f"Distances and directions are counted from {origin}; north is the direction of the map's y axis."


def _located(evidence: Evidence, points: Float, digits: int = 6) -> list[str]:
    """Return positions as text: latitude and longitude if the map's projection is known, otherwise map coordinates."""
    places = evidence.geo_reference.geographic(points)
    if places is None:
        return [f"map x {x:.1f} m, y {y:.1f} m" for x, y, _ in points.tolist()]
    return [
        f"{abs(north):.{digits}f}° {'N' if north >= 0 else 'S'}, {abs(east):.{digits}f}° {'E' if east >= 0 else 'W'}"
        for east, north, _ in places.tolist()
    ]


def _other_choices(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    yield Paragraph(outlook(record))
    elsewhere = (POSE_ERRORS, CHOSEN_FOR, BAND, UNRANKED, FEW, *LOCATED_FILES)
    notes = [sentence(note.partition(": the gap is")[0]) for note in record.notes if not note.startswith(elsewhere)]
    notes += [] if record.judgement is None else record.judgement.sentences()
    if record.returns is not None and record.judgement is None:
        notes.append(sentence(NOT_BY_DETECTION))
    notes.append(
        "What is proven of other choices refers to the model: this scene, these sensor models and this criterion."
    )
    yield Bullets(tuple(notes))
    if len(record.front if record.returns is None else record.returns.front) > 1:
        yield from _front(evidence)


def _front(evidence: Evidence) -> Iterator[Block]:
    """Yield the table of the best placements by number of sensors."""
    record, returns, budget = evidence.record, evidence.record.returns, evidence.record.request.goal.budget
    if returns is None:
        weighted = ", by its weights" if np.ptp(evidence.site.weights) > 0 else ""
        measured, head = f"see these shares of the road{weighted}.", "Seen"
        rows = [
            (
                *(point.count, point.price, percent(point.coverage)),
                f"at most {_points(point.missed)} more" if point.missed else "none sees more",
            )
            for point in record.front
        ]
    else:
        measured, head = "typically measure these numbers of points on a road user in each revolution.", "Points"
        rows = []
        for point in returns.front:
            most = f"none has more than {returns_within(point.returns, point.gap)}" if point.gap else "none has more"
            words = "may have more" if point.gap is None else most
            rows.append((point.count, point.price, returns_text(point.returns), words))
    limit = "" if budget is None else f" The budget of {dollars(budget)} does not limit the choices of this table."
    yield Paragraph(
        "With fewer or more sensors under the same rules, regardless of price, the best choices found by a short "
        f"search {measured}{limit}"
    )
    yield Table(
        ("Sensors", "Price installed, $" if record.installed else "Price, $", head, "Other choices"),
        tuple((str(count), f"{price:,.0f}", value, words) for count, price, value, words in rows),
        frozenset({0, 1, 2}),
    )


def after_failures(seen: Boolean) -> list[float]:
    """Return the share of the targets that is still seen when each sensor fails, from what each sees, (k, t)."""
    times = seen.sum(axis=0)
    return [float(np.count_nonzero(times - row > 0)) / seen.shape[1] for row in seen]


def _losses(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    left = after_failures(evidence.site.seen)
    if len(left) > 1:
        worst = record.sensors[left.index(min(left))].id
        seen, least = percent(sum(left) / len(left)), percent(min(left))
        worse = f" on average, and {least} in the worst case, the failure of {worst}" if seen != least else ""
        yield Paragraph(f"After the failure of one sensor, {seen} of the road is still seen{worse}.")
        yield Table(
            ("Failed", "Still seen", "Lost"),
            tuple(
                (sensor.id, percent(share), percent(max(0.0, record.coverage.whole - share)))
                for sensor, share in zip(record.sensors, left, strict=True)
            ),
            frozenset({1, 2}),
        )
    errors = [sentence(note) for note in record.notes if note.startswith(POSE_ERRORS)]
    scenarios = record.request.goal.scenarios
    if not errors and not scenarios.errs:
        errors = ["The loss from sensors that stand or point a little off their plan was not evaluated."]
    if scenarios.kind != "traffic":
        errors.append("The share of the road seen is that of an empty road: runs of traffic were not evaluated.")
        if record.returns is not None:
            errors.append("Points on road users have an allowance for vehicles that block the view on average.")
    if errors:
        yield Bullets(tuple(errors))
    for name in (*POSE_ERROR_PICTURES, TRAFFIC_PICTURE):
        if name in evidence.pictures:
            yield Picture(evidence.pictures[name], CAPTIONS[name])


def _trust(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    names = {sensor.sensor: sensor.sensor_name for sensor in record.sensors}
    lines = []
    models = [name for key, name in names.items() if key in PAPER_TYPES]
    if models:
        lines.append(f"Types 1 to 3 {PAPER_MODELS} This placement uses {' and '.join(models)}.")
    evidences = {sensor.sensor_name: sensor.evidence for sensor in record.sensors if sensor.sensor not in PAPER_TYPES}
    lines += [f"Range of {name}: {rests_on}." for name, rests_on in evidences.items() if rests_on]
    lines += [_named(note, names) for note in record.notes if note.startswith((BAND, UNRANKED))]
    chosen = (sensor.sensor for sensor in record.sensors)
    warnings = relevant_warnings(record.warnings, record.request.candidates.sensors, chosen)
    lines += [_named(warning, names) for warning in warnings]
    lines.append("The scene is a model: objects that it lacks do not block the view. Check the positions on site.")
    yield Bullets(tuple(lines))


def _sources(evidence: Evidence) -> Iterator[Block]:
    record = evidence.record
    lines = [f"Map data: {credit}." for credit in record.site.attribution] or [
        "Map data: the scene names no source that demands a credit."
    ]
    if any("OpenStreetMap" in credit for credit in record.site.attribution):
        lines.append(
            "OpenStreetMap is mostly drawn from aerial images, and may be off by several metres: set posts out from "
            "the kerb, not by coordinates."
        )
    if any(sensor.sensor in PAPER_TYPES for sensor in record.sensors):
        lines.append("Sensor types 1 to 3 and their prices: SEIP study of infrastructure-based collective perception.")
    version = record.versions.get("seip", "")
    lines.append(f"Program: SEIP for Blender {version}, GPL-3.0-or-later.".replace("  ", " "))
    yield Bullets(tuple(lines))
    if record.site.sources:
        yield Paragraph(
            "Where the objects of the scene come from, and for how many of them position or size is assumed:"
        )
        rows = tuple(
            (row.kind, row.source, f"{row.count:,}", f"{row.assumed:,}" if row.assumed else "none")
            for row in record.site.sources
        )
        yield Table(("Objects", "Source", "Number", "Assumed"), rows, frozenset({2, 3}))
    if record.site.assumptions:
        yield Paragraph("What was assumed or left out when the scene was built from the map:")
        yield Bullets(tuple(sentence(note) for note in record.site.assumptions))


def _settings(evidence: Evidence) -> Iterator[tuple[str, str]]:
    """Yield the settings of a placement that a reader can check, in words."""
    record = evidence.record
    goal, counts, targets = record.request.goal, record.counts, evidence.site.targets
    if goal.coverage is not None:
        asked = f"the cheapest sensors that see {percent(goal.coverage)} of the road{_limits_of(goal)}"
    else:
        what = "most of the road seen" if record.returns is None else "most points on road users"
        asked = f"{what}{_limits_of(goal)}"
    chosen_for = purpose(record.notes)
    chosen_for = "" if record.returns is not None and chosen_for == FOR_RETURNS else chosen_for
    yield "Asked for", f"{asked}{f', chosen{chosen_for}' if chosen_for else ''}"
    rules = ["the road in weighted regions counts more"] if goal.central_weight is not None else []
    rules += [f"sensors at least {goal.min_distance:g} m apart"] if goal.min_distance > 0 else []
    rules += [f"a sensor at {name}" for name in goal.mandatory] + [f"no sensor at {name}" for name in goal.forbidden]
    if rules:
        yield "Rules", "; ".join(rules)
    yield "Sensor types", ", ".join(record.request.candidates.sensors)
    positions = f"{counts.positions:,}, of which {counts.positions_on_poles:,} on existing poles"
    yield "Positions", f"{positions}; with all heights, types and directions {counts.poses:,}"
    yield "Road", f"{len(targets):,} squares of {targets.spacing:g} m, {evidence.area:,.0f} m² together"
    delta = record.request.visibility.delta
    yield "A square is seen", f"if a measured point lies within {delta:g} m of its centre"
    yield "Made", f"{record.times.created} by {record.objective.solver}"
    yield "With", ", ".join(f"{name} {version}" for name, version in record.versions.items())
    for name, value in record.inputs.items():
        yield f"Checksum of {name}", value


def _limits_of(goal: Objective) -> str:
    """Return the limits on a placement, its number of sensors and its price, as the end of a sentence."""
    count = "" if goal.count is None else f" with at most {counted(goal.count, 'sensor')}"
    return count if goal.budget is None else f"{count} for at most {dollars(goal.budget)}"


def _points(share: float) -> str:
    """Return a share as percentage points, rounded up."""
    return f"{math.ceil(share * 1000 - 1e-9) / 10:.1f} percentage points"


def returns_within(returns: float, gap: float) -> str:
    """Return a bound on returns as text, rounded up; the gap is the largest share by which 1 + returns can grow."""
    most = (1.0 + returns) * (1.0 + gap) - 1.0
    return f"{math.ceil(most - 1e-9):,}" if most >= 10 else f"{math.ceil(10 * most - 1e-9) / 10:.1f}"


def _named(note: str, names: Mapping[str, str]) -> str:
    """Return a note as a sentence with the names of sensor types in place of their catalogue keys."""
    known = {**{key: model.name for key, model in load_catalogue().items()}, **names}
    return re.sub(r"\w+", lambda word: known.get(word[0], word[0]), sentence(note))


def _mounting(sensor: RecordedSensor) -> str:
    """Return what a sensor is mounted on."""
    if sensor.pose is None:
        return "moved by hand: check on site"
    return f"existing pole ({sensor.position})" if sensor.on_pole else f"new post ({sensor.position})"
