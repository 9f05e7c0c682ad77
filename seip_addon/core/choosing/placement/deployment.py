"""A deployment: the chosen sensors with their coverage and price."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...geometry.orientation import describe_turn, orientation
from ...sensing.lidar.model import LidarModel
from ...sensing.scans.sensor import MountedSensor
from ...site.site import Candidates, Site
from .returns_summary import ReturnsSummary

BAND, UNRANKED = "over plausible gains", "not ranked"
"""First words of the messages of a `GainBand`."""


@dataclass(frozen=True, eq=False)
class Sensor(MountedSensor):
    """A chosen sensor: with its position, its share of the coverage, and its price.

    Parameters
    ----------
    pose : int or None
        Index among the site's candidates; None if a user has moved the sensor.
    position_name : str
        Name of the pole, or of the sampled position on the sidewalk.
    on_pole : bool
        Whether it is mounted on an existing pole.
    foot : (3,) float64, metres
        Ground point of the position, local site axes.
    height : float, metres
        Height above the ground point.
    yaw : float, radians
        Direction of azimuth zero, counter-clockwise from +x.
    tilt : float, radians
        Downward rotation of azimuth zero.
    alone : float
        Share of the targets that the sensor sees.
    added : float
        Share of the targets that the sensor sees and no sensor before it does; these shares add up to the coverage.
    marginal : float
        Share of the targets that only this sensor sees: the loss of coverage without it.
    roll : float, radians
        Rotation about azimuth zero; other than zero only after a user has rotated the sensor.
    installation : float, dollars, optional
        Cost of the installation; None if prices are those of sensors only.
    """

    orientation: Float = field(init=False)
    pose: int | None
    position_name: str
    on_pole: bool
    foot: Float
    height: float
    yaw: float
    tilt: float
    alone: float = 0.0
    added: float = 0.0
    marginal: float = 0.0
    roll: float = 0.0
    installation: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "orientation", orientation(self.yaw, self.tilt, self.roll))
        super().__post_init__()

    @property
    def price(self) -> float:
        """Price in dollars, with the installation if its cost is given."""
        return self.model.price + (self.installation or 0.0)

    @property
    def turned(self) -> str:
        """Yaw and tilt as text that follows the height."""
        return describe_turn(self.tilt, None if self.model.all_round else self.yaw)


@dataclass(frozen=True)
class TypeBand:
    """Coverage of a placement if all of its sensors were of one type, at that type's plausible gains."""

    sensor: str
    low: float
    high: float


@dataclass(frozen=True)
class GainBand:
    """Coverage of a placement over the plausible gains of its sensors.

    Parameters
    ----------
    low, high : float
        Share of the targets that is seen at the lowest and at the highest gains.
    sheets : tuple of str
        Catalogue keys of the placement's sensor types whose law of detection comes from a data sheet.
    types : tuple of TypeBand
        Band of each type that could be chosen; empty if there was only one.
    """

    low: float
    high: float
    sheets: tuple[str, ...]
    types: tuple[TypeBand, ...] = ()

    def messages(self) -> tuple[str, ...]:
        """Return messages on the band, and on the types that it does not rank."""
        messages = []
        if self.sheets:
            sheets = ", ".join(self.sheets)
            messages.append(
                f"{BAND} coverage is {_span(self.low, self.high)}: detection by {sheets} is derived from data "
                "sheets, not calibrated on a sweep"
            )
        pairs = combinations(self.types, 2)
        overlaps = [(one, other) for one, other in pairs if one.low <= other.high and other.low <= one.high]
        if overlaps:
            types = dict.fromkeys(one for pair in overlaps for one in pair)
            bands = ", ".join(f"{one.sensor} {_span(one.low, one.high)}" for one in types)
            messages.append(f"{UNRANKED}, as their plausible coverages overlap where the sensors are mounted: {bands}")
        return tuple(messages)


def _span(low: float, high: float) -> str:
    """Return two shares as text: one where both read the same."""
    return " to ".join(dict.fromkeys((f"{low:.1%}", f"{high:.1%}")))


@dataclass(frozen=True, eq=False)
class Deployment:
    """The chosen sensors and their joint coverage.

    Parameters
    ----------
    sensors : tuple of Sensor
        Sensors in the order of their labels.
    seen_by : (t,) int64
        Number of sensors that see each target.
    coverage : float
        Share of the targets that some sensor sees.
    seen_twice : float
        Share of the targets that two sensors or more see.
    central : float or None
        Coverage of the targets in weighted regions; None if there are none.
    weighted : float
        Share of the targets' weight that is seen.
    price : float, dollars
        Total price.
    rows : (k, t) bool
        Visibility of each target from each sensor.
    gain_band : GainBand, optional
        Coverage over the plausible gains, if some sensor type is not calibrated on a sweep.
    returns : ReturnsSummary, optional
        Returns from road users, if the sensors were chosen for them.
    pedestrian_returns : (t,) float64, optional
        Expected returns from a pedestrian near each target, if the sensors were chosen for returns.
    """

    sensors: tuple[Sensor, ...]
    seen_by: Integer
    coverage: float
    seen_twice: float
    central: float | None
    weighted: float
    price: float
    rows: Boolean
    gain_band: GainBand | None = None
    returns: ReturnsSummary | None = None
    pedestrian_returns: Float | None = None

    @property
    def installed(self) -> bool:
        """Whether the price includes posts, mounting, power and backhaul."""
        return any(sensor.installation is not None for sensor in self.sensors)


def price_text(price: float, *, installed: bool) -> str:
    """Return a price in whole dollars, followed by "installed" if it includes the installation."""
    return f"${price:,.0f}{' installed' if installed else ''}"


def pose_prices(candidates: Candidates, models: Mapping[str, LidarModel]) -> Float:
    """Return the price of a sensor at each candidate pose (c,), in dollars, with its installation if that is given."""
    prices = np.array([models[key].price for key in candidates.sensor])
    installation = candidates.installation
    return prices if installation is None else prices + installation[candidates.position_of]


def deploy(site: Site, models: Mapping[str, LidarModel], rows: Boolean, chosen: Sequence[int] | Integer) -> Deployment:
    """Return the chosen poses as sensors, with their coverage.

    Parameters
    ----------
    rows : (k, t) bool
        Visibility of each target from each chosen pose.
    chosen : (k,) int
        Indices of the chosen poses; their order breaks ties between labels.

    Examples
    --------
    >>> import shapely
    >>> from seip_addon.core.sensing.lidar.catalogue import load_catalogue
    >>> from seip_addon.core.site.candidates import CandidateSettings
    >>> from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
    >>> from seip_addon.core.site.site import make_site
    >>> road = np.array([[(0, 0, 0), (40, 0, 0), (40, 8, 0)], [(0, 0, 0), (40, 8, 0), (0, 8, 0)]], dtype=float)
    >>> poles = Pole("west", np.array([5.0, -1.0, 0.0])), Pole("east", np.array([35.0, -1.0, 0.0]))
    >>> region = shapely.box(0.0, 0.0, 40.0, 8.0)
    >>> scene = SceneGeometry("street", np.zeros(3), (Mesh("road", road),), (), (), region, poles=poles)
    >>> site = make_site(scene, CandidateSettings(sensors=("vlp16",), heights=(5.0,)), grid_spacing=8.0)
    >>> rows = np.array([[True, True, False, False, False], [False, True, True, True, False]])
    >>> deployment = deploy(site, load_catalogue(), rows, chosen=[0, 1])
    >>> [(sensor.label, sensor.position_name, sensor.alone, sensor.added) for sensor in deployment.sensors]
    [('S1', 'east', 0.6, 0.6), ('S2', 'west', 0.4, 0.2)]
    >>> deployment.coverage, deployment.seen_twice
    (0.8, 0.2)
    """
    order = _by_added_coverage(rows)
    poses = np.asarray(chosen, dtype=np.int64)[order]
    mounted = [sensor_at(site, models, f"S{rank + 1}", int(pose)) for rank, pose in enumerate(poses)]
    return deployment_of(site, mounted, rows[order])


def deployment_of(site: Site, mounted: Sequence[Sensor], rows: Boolean) -> Deployment:
    """Return sensors with their coverage, of each and of all together.

    Parameters
    ----------
    mounted : sequence of Sensor
        Sensors in the order in which each adds to those before it; the shares in them are ignored.
    rows : (k, t) bool
        Visibility of each target from each sensor.
    """
    seen_by = rows.sum(axis=0, dtype=np.int64)
    seen = seen_by > 0
    before: Integer = np.cumsum(rows, axis=0) - rows
    targets = site.targets
    sensors = tuple(
        replace(sensor, alone=_share(row), added=_share(row & (earlier == 0)), marginal=_share(row & (seen_by == 1)))
        for sensor, row, earlier in zip(mounted, rows, before, strict=True)
    )
    return Deployment(
        sensors=sensors,
        seen_by=seen_by,
        coverage=_share(seen),
        seen_twice=_share(seen_by > 1),
        central=_share(seen[targets.central]) if targets.central.any() else None,
        weighted=weighted_share(seen, targets.weight),
        price=float(sum(sensor.price for sensor in sensors)),
        rows=rows,
    )


def weighted_share(seen: Boolean, weight: Float) -> float:
    """Return the share of the weight that is seen; zero where all weights are zero."""
    total = float(weight.sum())
    return float(weight[seen].sum()) / total if total > 0.0 else 0.0


def _by_added_coverage(rows: Boolean) -> Integer:
    """Return the order of poses, given their rows (k, t), in which each adds the most targets to those before it."""
    left = list(range(len(rows)))
    unseen = np.ones(rows.shape[1], dtype=bool)
    order: list[int] = []
    while left:
        best = max(left, key=lambda row: int((rows[row] & unseen).sum()))
        left.remove(best)
        order.append(best)
        unseen &= ~rows[best]
    return np.array(order, dtype=np.int64)


def sensor_at(site: Site, models: Mapping[str, LidarModel], label: str, pose: int) -> Sensor:
    """Return the sensor at a candidate pose, without its coverage."""
    candidates = site.candidates
    position = int(candidates.position_of[pose])
    return Sensor(
        label=label,
        pose=pose,
        model=models[str(candidates.sensor[pose])],
        position_name=str(candidates.position_name[position]),
        on_pole=bool(candidates.on_pole[position]),
        foot=candidates.position[position],
        xyz=candidates.xyz[pose],
        height=float(candidates.height[pose]),
        yaw=float(candidates.yaw[pose]),
        tilt=float(candidates.tilt[pose]),
        installation=None if candidates.installation is None else float(candidates.installation[position]),
    )


def _share(these: Boolean) -> float:
    return float(np.count_nonzero(these)) / len(these)
