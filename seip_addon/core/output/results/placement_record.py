"""Content of ``placement.json``: a placement with the data to read, check and repeat it.

`tests/core/output/results/test_placement_record.py` shows its use.
"""

import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from datetime import datetime
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

import numpy as np

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...choosing.placement.deployment import GainBand, Sensor, price_text
from ...choosing.placement.judgement import Judgement
from ...choosing.placement.objective import FrontPoint, Objective, Solution
from ...choosing.placement.problem import Placement
from ...choosing.placement.returns_summary import CrossingReturns, ReturnsSummary, share_reached
from ...choosing.placement.search_limits import DEFAULT_EFFORT
from ...geometry.geo_reference import GeoReference
from ...geometry.orientation import degrees, orientation, tilt_degrees
from ...sensing.lidar.model import LidarModel
from ...sensing.scans.sensor import MountedSensor
from ...sensing.visibility.settings import Engine, VisibilitySettings
from ...sensing.weather import Weather
from ...site.candidates import CandidateSettings
from ...site.installed_cost import InstalledCost
from ...site.site import Site
from ...site.sources import SourceCount
from ...storage.files import save_json
from ...storage.json_dataclass import from_json, read_record

Point = tuple[float, float, float]

Value = TypeVar("Value")

SCHEMA, OLDER_SCHEMA = "seip-placement/4", "seip-placement/3"
"""Version that is written, and the one before, which is read as well."""
SHARE_DIGITS = 9
DIGITS: Mapping[str, int | None] = {
    **dict.fromkeys(("price_usd", "installation_usd", "price"), 2),  # dollars
    **dict.fromkeys(("typical", "of_each", "least", "returns"), 3),  # returns, to what single precision holds
    **dict.fromkeys(("easting_m", "northing_m", "durations_s"), 3),
    # The micrometre hides the last bits in which platforms differ.
    **dict.fromkeys(("origin_m", "header_offset_m", "local_m", "map_m", "height_m", "altitude_m"), 6),
    **dict.fromkeys(("latitude_deg", "longitude_deg"), 8),
    **dict.fromkeys(("yaw_deg", "tilt_deg", "roll_deg", "header_heading_deg"), None),  # see `headings`
    **dict.fromkeys(("objective", "value", "bound", "settings", "judgement"), None),
}
"""Decimal places of what is not a share; None where numbers stay as they are."""
LEFT_OUT = {"roll_deg", "installation_usd", "returns", "judgement"}  # if they are None


@dataclass(frozen=True)
class Provenance:
    """Time of a placement with its time zone, seconds of each step, and versions; see `versions`."""

    created: datetime
    durations: Mapping[str, float]
    versions: Mapping[str, str]


def relevant_warnings(warnings: Iterable[str], considered: Iterable[str], chosen: Iterable[str]) -> list[str]:
    """Return the warnings but those of sensor types that were considered and not chosen; types are catalogue keys."""
    others = set(considered) - set(chosen)
    return [warning for warning in warnings if warning.partition(":")[0] not in others]


@dataclass(frozen=True)
class RecordedGeoReference:
    """Georeference of the scene's map; UTM zones are those of its hemisphere, see `GeoReference.in_hemisphere`."""

    projection: str
    header_offset_m: Point
    header_heading_deg: float

    @property
    def geo_reference(self) -> GeoReference:
        """The georeference of the map."""
        return GeoReference(self.projection, (*self.header_offset_m, math.radians(self.header_heading_deg)))


@dataclass(frozen=True)
class RecordedSite:
    """A scene, the map coordinates of its local origin, and what its map says of where that is; see `Site`.

    Records of earlier versions lack all but the name and the origin.

    Parameters
    ----------
    altitude_zero : str
        Level that altitudes count from, in words; see `Site.altitude_zero`.
    """

    name: str
    origin_m: Point
    geo_reference: RecordedGeoReference | None = None
    altitude_zero: str = ""
    sources: tuple[SourceCount, ...] = ()
    attribution: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordedSensor:
    """One chosen sensor, by its label: see `placement.deployment.Sensor`.

    Records of earlier versions lack ``evidence``, ``location`` and ``all_round``.

    Parameters
    ----------
    pose : int or None
        Row of the visibility grid; None for a sensor that was moved by hand, which has a roll.
    sensor : str
        Its type's key in the catalogue.
    latitude_deg, longitude_deg, altitude_m : float, optional
        On WGS 84, and the height above the map's zero; None if the map's projection is not known.
    easting_m, northing_m : float, optional
        Coordinates of the record's projection: map coordinates and the offset of its header. None likewise.
    evidence : str
        Basis of its type's law of detection.
    installation_usd : float, optional
        Share of the price for installation; None if prices are those of sensors only.
    location : str
        Street, side and distances in words; see `locations`.
    all_round : bool
        Whether its type measures in all directions, so that its yaw does not matter.
    """

    id: str
    pose: int | None
    sensor: str
    sensor_name: str
    position: str
    on_pole: bool
    local_m: Point
    map_m: Point
    height_m: float
    yaw_deg: float
    tilt_deg: float
    price_usd: float
    coverage_alone: float
    coverage_added: float
    coverage_marginal: float
    roll_deg: float | None = None
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    altitude_m: float | None = None
    easting_m: float | None = None
    northing_m: float | None = None
    evidence: str = ""
    installation_usd: float | None = None
    location: str = ""
    all_round: bool = False

    @property
    def orientation(self) -> Float:
        """Rotation from its axes to the site's, (3, 3) float64."""
        return orientation(*map(math.radians, (self.yaw_deg, self.tilt_deg, self.roll_deg or 0.0)))

    def mounted(self, model: LidarModel) -> MountedSensor:
        """Return the sensor as scans have it, with the LiDAR model of its type."""
        return MountedSensor(self.id, model, np.array(self.local_m), self.orientation)


@dataclass(frozen=True)
class RecordedCoverage:
    """Shares of the targets, or of their weight, that are seen.

    ``central`` is None without weighted regions, ``gain_band`` where all sensors are calibrated on sweeps.
    """

    whole: float
    central: float | None
    weighted: float
    seen_twice: float
    gain_band: GainBand | None = None


@dataclass(frozen=True)
class RecordedObjective:
    """Objective value, in covered weight or dollars, with its bound; None without a bound."""

    kind: Literal["vanilla", "weighted"]
    sought: Literal["most coverage", "most returns", "least price"]
    value: float
    bound: float | None
    gap: float | None
    status: str
    solver: str

    @property
    def cheapest(self) -> bool:
        """Whether the least price was sought."""
        return self.sought == "least price"


@dataclass(frozen=True)
class RecordedGreedy:
    """The greedy answer to the same question, and the share of the objective that it loses."""

    value: float
    bound: float | None
    gap_to_placement: float
    poses: tuple[int, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class RecordedCounts:
    """Numbers of targets, positions and poses, and of candidates that were dropped, by reason."""

    targets: int
    targets_central: int
    positions: int
    positions_on_poles: int
    poses: int
    dropped: Mapping[str, int]


@dataclass(frozen=True)
class RecordedTimes:
    """When a placement was made (ISO 8601), and how many seconds each step took."""

    created: str
    durations_s: Mapping[str, float]


@dataclass(frozen=True)
class RecordedSettings:
    """Settings of a placement; records of earlier versions may lack all but the objective and the sensor types.

    ``catalogue`` has the names of the user's own catalogues without their folders, and ``render`` is whether the result
    includes a rendered view.
    """

    goal: Objective
    candidates: CandidateSettings
    visibility: VisibilitySettings = VisibilitySettings()
    weather: Weather = Weather()
    grid_spacing_m: float = 1.0
    catalogue: tuple[str, ...] = ()
    engine: Engine = "auto"
    solver: str = "auto"
    effort: float = DEFAULT_EFFORT
    installed_cost: InstalledCost | None = None
    render: bool = False


@dataclass(frozen=True)
class PlacementRecord:
    """Content of ``placement.json`` without its schema, key by key; see docs/formats.md.

    Records of earlier versions lack ``front`` and ``crossings``.

    Parameters
    ----------
    settings : mapping
        All settings by name; `request` is the part that this program reads again.
    inputs : mapping of str to str
        Digests of the inputs.
    returns : ReturnsSummary, optional
        Returns from road users, if the placement was chosen for them.
    front : tuple of FrontPoint
        Best placements found with fewer and more sensors.
    crossings : tuple of CrossingReturns
        Expected returns from a pedestrian on each crossing.
    judgement : Judgement, optional
        Detections with it and with other finalists, if it was chosen among them.
    """

    site: RecordedSite
    sensors: tuple[RecordedSensor, ...]
    price_usd: float
    coverage: RecordedCoverage
    objective: RecordedObjective
    greedy: RecordedGreedy | None
    counts: RecordedCounts
    settings: Mapping[str, object]
    seeds: Mapping[str, int]
    inputs: Mapping[str, str]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    versions: Mapping[str, str]
    times: RecordedTimes
    returns: ReturnsSummary | None = None
    front: tuple[FrontPoint, ...] = ()
    crossings: tuple[CrossingReturns, ...] = ()
    judgement: Judgement | None = None

    def __post_init__(self) -> None:
        _ = self.request  # refuses settings that cannot be read again

    @cached_property
    def request(self) -> RecordedSettings:
        """The settings that this program reads again."""
        return from_json(RecordedSettings, self.settings, "settings")

    @property
    def poses(self) -> Integer:
        """Rows of the visibility grid of the sensors at candidate poses, (k,) int64."""
        return np.array([sensor.pose for sensor in self.sensors if sensor.pose is not None], dtype=np.int64)

    @property
    def placement(self) -> Placement:
        """The placement that `placement_record` wrote down."""
        found = self.objective
        return Placement(
            chosen=self.poses,
            objective=found.value,
            bound=math.nan if found.bound is None else found.bound,
            gap=math.inf if found.gap is None else found.gap,
            status=found.status,
            solver=found.solver,
            price=self.price_usd,
            notes=self.notes,
        )

    def is_of(self, inputs: Mapping[str, str]) -> bool:
        """Return whether the placement was made from inputs with these digests; older records hold fewer digests."""
        return all(inputs.get(name) == digest for name, digest in self.inputs.items())

    @property
    def installed(self) -> bool:
        """Whether its prices count posts, mounting, power and backhaul."""
        return any(sensor.installation_usd is not None for sensor in self.sensors)

    @property
    def price_text(self) -> str:
        """The price in dollars, as text."""
        return price_text(self.price_usd, installed=self.installed)

    def as_json(self) -> dict[str, Any]:
        """Return the value of ``placement.json``, its keys in order."""

        def present(items: list[tuple[str, Any]]) -> dict[str, Any]:
            return {name: value for name, value in items if value is not None or name not in LEFT_OUT}

        return {"schema": SCHEMA, **asdict(self, dict_factory=present)}

    def text(self) -> str:
        """Return the record in one line of JSON, for `parsed_record`."""
        return json.dumps(self.as_json(), ensure_ascii=False, allow_nan=False)


def placement_record(
    site: Site,
    solution: Solution,
    provenance: Provenance,
    *,
    settings: Mapping[str, object],
    inputs: Mapping[str, str],
    warnings: tuple[str, ...],
) -> PlacementRecord:
    """Return the record of a placement.

    Parameters
    ----------
    settings : mapping
        All that the user could have set, defaults included, by name; values that JSON can hold.
    inputs : mapping of str to str
        Digests or names of the inputs.
    warnings : tuple of str
        What the user should know before trusting the figures.
    """
    deployment, placement, objective = solution.deployment, solution.placement, solution.objective
    of_returns, candidates = deployment.returns is not None, site.candidates
    known = site.geo_reference.in_hemisphere(site.origin)
    *offset, heading = known.header_offset
    reference = RecordedGeoReference(known.projection, _point(offset), tilt_degrees(heading))
    greedy = (
        None
        if solution.greedy is None
        else RecordedGreedy(
            value=_significant(solution.greedy.objective),
            # The better of the two bounds: once the optimum is proven, it no longer depends on a platform's rounding.
            bound=_if_finite(min(solution.greedy.bound, placement.bound)),
            gap_to_placement=1.0 - share_reached(solution.greedy.objective, placement.objective, of_returns=of_returns),
            poses=tuple(solution.greedy.chosen.tolist()),
            notes=solution.greedy.notes,
        )
    )
    record = PlacementRecord(
        site=RecordedSite(
            *(site.name, _point(site.origin), reference if known.projection else None, site.altitude_zero),
            *(site.sources, site.attribution, site.assumptions),
        ),
        sensors=tuple(recorded_sensor(sensor, site) for sensor in deployment.sensors),
        price_usd=float(deployment.price),
        coverage=RecordedCoverage(
            *(deployment.coverage, deployment.central, deployment.weighted, deployment.seen_twice),
            deployment.gain_band,
        ),
        objective=RecordedObjective(
            kind="vanilla" if objective.central_weight is None else "weighted",
            sought="least price" if objective.cheapest else "most returns" if of_returns else "most coverage",
            value=_significant(placement.objective),
            bound=_if_finite(placement.bound),
            gap=_if_finite(placement.gap),
            status=placement.status,
            solver=placement.solver,
        ),
        greedy=greedy,
        counts=RecordedCounts(
            targets=len(site.targets),
            targets_central=int(np.count_nonzero(site.targets.central)),
            positions=len(candidates.position),
            positions_on_poles=int(np.count_nonzero(candidates.on_pole)),
            poses=len(candidates),
            dropped={reason: int(count) for reason, count in sorted(candidates.dropped.items())},
        ),
        settings=dict(settings),
        seeds={},  # visibility and placement draw no random numbers
        inputs=dict(inputs),
        notes=placement.notes,
        warnings=warnings,
        versions=dict(provenance.versions),
        times=RecordedTimes(provenance.created.isoformat(timespec="seconds"), provenance.durations),
        returns=deployment.returns,
        front=tuple(solution.front),
        crossings=tuple(solution.crossings),
        judgement=solution.judgement,
    )
    return _rounded_parts(record)


def recorded_sensor(sensor: Sensor, site: Site) -> RecordedSensor:
    """Return the record of a sensor of a deployment on a site."""
    map_xyz, place = sensor.xyz + site.origin, site.geographic(sensor.xyz[None])
    longitude, latitude, altitude = (None,) * 3 if place is None else place[0]
    reference = site.geo_reference.in_hemisphere(site.origin)
    easting, northing = (None, None) if place is None else reference.projected(map_xyz[None])[0, :2]
    record = RecordedSensor(
        id=sensor.label,
        pose=sensor.pose,
        sensor=sensor.model.key,
        sensor_name=sensor.model.name,
        position=sensor.position_name,
        on_pole=sensor.on_pole,
        local_m=_point(sensor.xyz),
        map_m=_point(map_xyz),
        height_m=sensor.height,
        yaw_deg=degrees(sensor.yaw),
        tilt_deg=tilt_degrees(sensor.tilt),
        price_usd=sensor.price,
        coverage_alone=sensor.alone,
        coverage_added=sensor.added,
        coverage_marginal=sensor.marginal,
        roll_deg=tilt_degrees(sensor.roll) if sensor.pose is None else None,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=altitude,
        easting_m=easting,
        northing_m=northing,
        evidence=sensor.model.evidence,
        all_round=sensor.model.all_round,
        installation_usd=sensor.installation,
    )
    return _rounded_parts(record)


def _rounded_parts(value: Value, digits: int | None = SHARE_DIGITS) -> Value:
    """Round all numbers in a dataclass, tuple or mapping: shares, or what `DIGITS` has by its name."""
    rounded: Any = value
    if digits is None:
        return value
    if isinstance(value, float):
        rounded = round(float(value), digits) + 0.0  # no negative zero
    elif isinstance(value, tuple):
        rounded = tuple(_rounded_parts(part, digits) for part in value)
    elif isinstance(value, Mapping):
        rounded = {name: _rounded_parts(part, digits) for name, part in value.items()}
    elif is_dataclass(value) and not isinstance(value, type):
        own = ((each.name, getattr(value, each.name)) for each in fields(value))
        rounded = replace(value, **{name: _rounded_parts(part, DIGITS.get(name, SHARE_DIGITS)) for name, part in own})
    return cast("Value", rounded)


def _point(xyz: Iterable[float]) -> Point:
    x, y, z = map(float, xyz)
    return x, y, z


def _significant(value: float) -> float:
    return float(f"{value:.12g}")


def _if_finite(value: float) -> float | None:
    """Return None for a bound, or a gap, that the solver has not found."""
    return _significant(value) if math.isfinite(value) else None


def save_placement(path: str | os.PathLike[str], record: PlacementRecord) -> None:
    """Write ``placement.json``."""
    save_json(path, record.as_json())


def load_placement(path: str | os.PathLike[str]) -> PlacementRecord:
    """Read ``placement.json``.

    Raises
    ------
    SeipError
        There is no such file, or it is not a placement of a version that this program can read.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror}; name the placement.json of a finished run") from error
    return _read(content, str(path))


@lru_cache(maxsize=8)
def parsed_record(text: str) -> PlacementRecord:
    """Read the record that a scene keeps as `PlacementRecord.text`; panels do so at every redraw."""
    return _read(text, "the placement that this scene keeps")


def comparable(record: PlacementRecord) -> dict[str, Any]:
    """Return the content of a file without times and versions, which differ between machines and runs."""
    return {key: value for key, value in record.as_json().items() if key not in {"times", "versions"}}


def _read(text: str | bytes, name: str) -> PlacementRecord:
    return read_record(PlacementRecord, text, (SCHEMA, OLDER_SCHEMA), name, "place the sensors again")
