"""Criterion, scenarios, risk measure and constraints of a placement, and the problem that they make of a site."""

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...base.errors import SeipError
from ...base.limits import CHOSEN_WEIGHT, DISTANCE, PRICE, SENSORS
from ...base.settings import setting
from ...sensing.lidar.carla_dropoff import CarlaDropoff
from ...sensing.lidar.model import LidarModel
from ...site.site import Candidates, Site
from ..robustness.comparison import Comparison
from .deployment import BAND, UNRANKED, Deployment, pose_prices
from .judgement import Judgement
from .problem import Placement, PlacementConstraints, PlacementProblem
from .returns_summary import CrossingReturns
from .risk import Failure, Risk
from .scenarios import Scenarios

DEFAULT_COUNT = 4  # number of sensors if neither a number nor a budget nor a coverage is given: that of the study
MOVED = "moved by hand"  # status of a placement whose sensors a user has moved
MOVED_MESSAGE = "Evaluated at the sensors' current poses, without proof of optimality."
ACCEPTED_MESSAGE = "accepted before the end of the search: running it to its end may find a better placement"
CHOSEN_FOR = "chosen "  # beginning of a note on what was optimised in place of nominal coverage
SAME_PRICE = "among equally cheap placements "  # beginning of the note on the coverage that another one may reach

TAILS = {"mean": 1.0, "worst-quarter": 0.25, "worst": 0.0}
"""Share of the scenarios, the worst ones, over which each risk measure averages."""


@dataclass(frozen=True)
class Objective:
    """Objective and constraints: a criterion over scenarios with a risk measure, for N sensors or a budget.

    The reverse problem asks for the least price of a coverage.

    Parameters
    ----------
    count : int, optional
        N, the largest number of sensors.
    budget : float, dollars, optional
        The largest total price.
    coverage : float, optional
        Share (0 to 1] of the weight to be seen at the least price; the reverse problem.
    central_weight : float or "scene", optional
        The weighted problem: weight of the targets in weighted regions, or the scene's own weights. Default: the
        vanilla problem, in which all targets have the same weight.
    min_distance : float, metres
        Least distance between two sensors.
    forbidden, mandatory : tuple of str
        Names of positions that must not, and that must, carry a sensor.
    criterion : {"auto", "road", "returns"}
        Quantity that is maximised: the road seen, or the expected returns from road users; see `criterion_of`.
    shares : (float, float, float)
        Importance of cars, cyclists and pedestrians for the returns, in proportion.
    scenarios : Scenarios
        Scenarios over which the placement is optimised, and on which it is evaluated.
    risk : {"auto", "none", "mean", "worst-quarter", "worst"}
        Risk measure over the scenarios: their mean, or that of the worst quarter (the conditional value at risk), or
        the worst. ``auto`` is the worst quarter of pose errors and the mean of traffic; with ``none`` the placement is
        optimised for the nominal scenario, and only evaluated on the others.
    failures : {"none", "worst", "mean"}
        Failure of one sensor after which the outcome is measured: none, the most important sensor, or any of them on
        average.

    Raises
    ------
    SeipError
        A number is out of its limits, or the parts contradict each other.
    """

    count: int | None = setting(
        None, f"largest number of sensors ({DEFAULT_COUNT} if no objective is given)", minimum=1, metavar="N"
    )
    budget: float | None = setting(
        None, "largest total price", unit="USD", minimum=0.0, maximum=PRICE.most, metavar="USD"
    )
    coverage: float | None = setting(
        None, "reach this share (0 to 1) at the least price", minimum=0.0, maximum=1.0, metavar="SHARE"
    )
    central_weight: float | Literal["scene"] | None = None
    min_distance: float = setting(0.0, "least distance between two sensors", unit="m", minimum=0.0, metavar="M")
    forbidden: tuple[str, ...] = setting((), "positions without sensor", option="forbid", metavar="POSITION")
    mandatory: tuple[str, ...] = ()
    criterion: Literal["auto", "road", "returns"] = setting(
        "auto",
        "optimise the road seen, or the returns from road users (auto: returns, if sensors have a range law)",
    )
    shares: tuple[float, float, float] = setting(
        (1.0, 1.0, 1.0),
        "importance of cars, cyclists and pedestrians for returns (1 1 1)",
        minimum=0.0,
        maximum=CHOSEN_WEIGHT.most,
        metavar="W",
    )
    scenarios: Scenarios = Scenarios()
    risk: Literal["auto", "none", "mean", "worst-quarter", "worst"] = setting(
        "auto",
        "measure over the scenarios (auto: worst-quarter of pose errors, mean of traffic; none: only evaluate)",
    )
    failures: Failure = setting("none", "optimise what is left after the worst sensor, or any sensor (mean), fails")

    def __post_init__(self) -> None:
        for name, limits in (("budget", PRICE), ("min_distance", DISTANCE)):
            value = getattr(self, name)
            if value is not None and not limits.allow(value):
                raise SeipError(f"the {name.replace('_', ' ')} must be {limits}, not {value}")
        if self.count is not None and not SENSORS.allow(self.count):
            raise SeipError(f"the number of sensors must be {SENSORS}, not {self.count}")
        if self.coverage is not None and not 0 < self.coverage <= 1:
            raise SeipError(f"the coverage to reach must be a share above 0 and at most 1, not {self.coverage:g}")
        weight = self.central_weight
        if isinstance(weight, float | int) and not CHOSEN_WEIGHT.allow(weight):
            raise SeipError(f"the central weight must be {CHOSEN_WEIGHT}, not {weight}")
        if self.coverage is not None and self.criterion == "returns":
            raise SeipError("a coverage to reach is a share of the road: leave out the criterion returns")
        if not all(CHOSEN_WEIGHT.allow(share) or share == 0 for share in self.shares) or not any(self.shares):
            raise SeipError(
                f"the shares of cars, cyclists and pedestrians must be {CHOSEN_WEIGHT} or 0, one of them above 0"
            )
        both = sorted(set(self.forbidden) & set(self.mandatory))
        if both:
            raise SeipError(f"position {both[0]!r} is both forbidden and mandatory: take it out of one of the two")
        self._check_scenarios()

    def _check_scenarios(self) -> None:
        kind, measure = self.scenarios.kind, self.measure
        if self.failures != "none" and (self.risk == "none" or kind == "traffic"):
            other = "the risk none" if self.risk == "none" else "traffic"
            raise SeipError(f"sensor failures cannot be combined with {other}: leave one out")
        idle = "the risk measure" if self.risk != "auto" else "the seed of the scenarios" if self.scenarios.seed else ""
        if kind == "nominal" and idle:
            raise SeipError(
                f"{idle} has no effect on nominal poses and the empty road: choose pose errors or traffic as "
                "scenarios, or leave it out"
            )
        if measure is None:
            return
        # With failures the risk none is refused: only evaluating is no cure there.
        instead = "only evaluate (risk none)" if self.failures == "none" else "leave out failures"
        if self.cheapest:
            raise SeipError(
                "optimising over scenarios or for failures needs a number of sensors or a budget, not a coverage to "
                f"reach: give one of these, or {instead}"
            )
        if self.criterion == "returns":
            raise SeipError(
                "returns from road users are optimised for nominal poses and the empty road: choose the criterion road "
                f"for scenarios or failures, or {instead}"
            )
        if self.count is not None:
            measure.require_sensors(self.count)

    @property
    def measure(self) -> Risk | None:
        """Risk measure that is maximised over the scenarios; None for nominal poses on the empty road."""
        if self.risk == "none" or (self.scenarios.kind == "nominal" and self.failures == "none"):
            return None
        usual = "worst-quarter" if self.scenarios.kind == "pose-errors" else "mean"
        return Risk(TAILS[usual if self.risk == "auto" else self.risk], self.failures)

    @property
    def cheapest(self) -> bool:
        """Whether this is the reverse problem: the least price for a coverage."""
        return self.coverage is not None


def criterion_of(objective: Objective, models: Mapping[str, LidarModel]) -> Literal["road", "returns"]:
    """Return the criterion of an objective for the sensor types to choose from.

    Coverage of the road predicts detection where every return counts, as for the sensors of the SEIP paper. Sensors
    with a range law detect vehicles at several times the distance of asphalt: for these, the returns from road users
    are the better predictor.

    Examples
    --------
    >>> from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
    >>> models = find_models(load_catalogue(), ["os1_128"])
    >>> criterion_of(Objective(count=4, forbidden=("Pole 7",)), models)
    'returns'
    >>> criterion_of(Objective(coverage=0.9), models)
    'road'
    """
    if objective.criterion != "auto":
        return objective.criterion
    range_laws = any(not isinstance(model.law, CarlaDropoff) for model in models.values())
    return "returns" if range_laws and not objective.cheapest and objective.measure is None else "road"


@dataclass(frozen=True)
class FrontPoint:
    """The best placement found with at most ``count`` sensors.

    Parameters
    ----------
    coverage : float
        Share of the weight that it covers.
    price : float, dollars
    missed : float
        Largest share of the weight that another placement could cover in addition; 0 where this one is proven optimal.
    """

    count: int
    coverage: float
    price: float
    missed: float


@dataclass(frozen=True, eq=False)
class Solution:
    """A solution: an objective with its placement, certificate, deployment and evaluation.

    Parameters
    ----------
    objective : Objective
        Objective, with the number of sensors filled in where none was given.
    greedy : Placement or None
        Greedy solution of the same problem; None for the reverse problem and over scenarios.
    evaluation : Comparison, optional
        Comparison with the nominal optimum on held-out scenarios, where the placement was optimised over scenarios.
    front : tuple of FrontPoint
        Best placements found with fewer and more sensors; see `front_of`. Empty if they were not searched for.
    crossings : tuple of CrossingReturns
        Expected returns from a pedestrian on each crossing, of all sensors together. Empty if not computed.
    judgement : Judgement, optional
        What a detector finds with the placement and with other finalists, if it was chosen among such.
    """

    objective: Objective
    placement: Placement
    greedy: Placement | None
    deployment: Deployment
    evaluation: Comparison | None = None
    front: tuple[FrontPoint, ...] = ()
    crossings: tuple[CrossingReturns, ...] = ()
    judgement: Judgement | None = None

    @property
    def certificate(self) -> str:
        """The certificate as a message: proven optimal, or within which gap."""
        status, gap, notes = self.placement.status, self.placement.gap, self.placement.notes
        return certificate(status, gap, cheapest=self.objective.cheapest, notes=notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the placement, those on the plausible gains of its sensors last."""
        band = self.deployment.gain_band
        return tuple(dict.fromkeys((*self.placement.notes, *(band.messages() if band else ()))))

    @property
    def caption(self) -> tuple[str, ...]:
        """Caption of a picture: certificate, plausible gains, and the objective if it is not nominal coverage."""
        return (self.certificate, *(note for note in self.notes if note.startswith((CHOSEN_FOR, BAND, UNRANKED))))


def certificate(status: str, gap: float | None, *, cheapest: bool, notes: Sequence[str] = ()) -> str:
    """Return a placement's certificate as a message: proven optimal, or within a gap.

    Parameters
    ----------
    gap : float or None
        Gap between bound and objective, as a share of the objective; None or infinite without a bound.
    notes : sequence of str
        Notes on the placement. One may state that something other than nominal coverage was optimised.
    """
    if status == MOVED:
        return MOVED_MESSAGE
    best, among = "cheapest" if cheapest else "best", f"among these candidates{purpose(notes)}."
    if status == "optimal":
        return f"Proven by the criterion: the {best} placement {among}"
    share = "an unknown share" if gap is None or not math.isfinite(gap) else f"{gap:.2%}"
    return f"Within {share} of the {best} placement possible {among}"


def purpose(notes: Sequence[str]) -> str:
    """Return the purpose of a placement from its notes, after a space, or "" for nominal coverage."""
    chosen_for = next((note.removeprefix(CHOSEN_FOR) for note in notes if note.startswith(CHOSEN_FOR)), "")
    return chosen_for and f" {chosen_for.partition(':')[0]}"


def target_weights(site: Site, objective: Objective) -> NDArray[np.float64]:
    """Weight of each target under an objective, (t,) float64."""
    return weights_in_regions(objective, site.targets.weight, site.targets.central)


def weights_in_regions(
    objective: Objective, weight: NDArray[np.float64], central: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the weights of points under an objective, (n,) float64.

    Parameters
    ----------
    weight : (n,) float64
        The scene's own weights.
    central : (n,) bool
        Whether a point lies in some weighted region.

    Raises
    ------
    SeipError
        The objective is weighted, and no point lies in a weighted region.
    """
    if objective.central_weight is None:
        return np.ones(len(weight))
    if not central.any():
        raise SeipError("the weighted problem needs a weighted region: draw one in SEIP Weighted Regions")
    if objective.central_weight == "scene":
        return weight
    return np.where(central, objective.central_weight, 1.0)


def placement_problem(
    site: Site, visible: NDArray[np.bool_], models: Mapping[str, LidarModel], objective: Objective
) -> PlacementProblem:
    """State an objective on a site as a maximal covering location problem.

    Parameters
    ----------
    visible : (c, t) bool

    Raises
    ------
    SeipError
        The objective contradicts itself or the site.
    """
    return PlacementProblem(amounts=visible, **vars(placement_constraints(site, models, objective)))


def placement_constraints(site: Site, models: Mapping[str, LidarModel], objective: Objective) -> PlacementConstraints:
    """Return the constraints and weights of an objective on a site.

    Raises
    ------
    SeipError
        The objective contradicts itself or the site.
    """
    candidates = site.candidates
    groups = np.concatenate((candidates.mandatory, _named(candidates, objective.mandatory)))
    forbidden = _named(candidates, objective.forbidden).any(axis=0)
    return PlacementConstraints(
        weights=target_weights(site, objective),
        prices=pose_prices(candidates, models),
        positions=candidates.position_of,
        xyz=candidates.xyz,
        labels=candidates.sensor,
        mandatory=groups[:, candidates.position_of],
        mandatory_names=np.concatenate((candidates.mandatory_name, np.array(objective.mandatory, dtype=np.str_))),
        forbidden=forbidden[candidates.position_of],
        count=with_count(objective, site).count,
        budget=objective.budget,
        min_distance=objective.min_distance,
    )


def check_objective(site: Site, models: Mapping[str, LidarModel], objective: Objective) -> None:
    """Raise SeipError if a site cannot meet an objective, before any ray is cast."""
    placement_constraints(site, models, objective)


def with_count(objective: Objective, site: Site) -> Objective:
    """Return the objective with the default number of sensors if no number, budget or coverage is given."""
    free = objective.count is None and objective.budget is None and objective.coverage is None
    return replace(objective, count=min(DEFAULT_COUNT, len(site.candidates.position))) if free else objective


def _named(candidates: Candidates, names: Sequence[str]) -> NDArray[np.bool_]:
    """Return the positions of each of k names, (k, p) bool."""
    known: list[str] = candidates.position_name.tolist()
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
            hint = f"there are {known[0]!r} to {known[-1]!r}"
            if near:
                hint = f"did you mean {' or '.join(map(repr, near))}?"
            raise SeipError(f"there is no position {name!r}; {hint} (quote names with blanks)")
    found: NDArray[np.bool_] = np.array(names, dtype=np.str_)[:, None] == candidates.position_name
    return found
