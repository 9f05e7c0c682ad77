"""The placement problem and its solution."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer, Text
from ...base.errors import SeipError
from .concave import COVERAGE, Concave

TIE_TOLERANCE = 1e-9  # share of all weight, or of the price, below which differences count as rounding


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacementConstraints:
    """Candidates, target weights and constraints of a placement problem, without the visibility matrix.

    They can be checked before any ray is cast.

    Parameters
    ----------
    weights : (t,) float64
        w, at least 0; all ones in the vanilla problem.
    prices : (c,) float64
        p, at least 0.
    positions : (c,) int64
        Position of each pose; at most one pose is chosen at each.
    xyz : (c, 3) float64, metres
        Position of each pose's sensor.
    labels : (c,) str
        Sensor type of each pose. Poses are put into the order of x, y, z and label before anything else, so that the
        order in which they are given never matters.
    mandatory : (g, c) bool, optional
        Each row is a group of poses of which at least one must be chosen.
    forbidden : (c,) bool, optional
        Poses that must not be chosen.
    count : int, optional
        N, the largest number of sensors.
    budget : float, optional
        C, the largest total price.
    min_distance : float, metres
        Smallest distance in plan between two chosen sensors.

    Raises
    ------
    SeipError
        The figures contradict themselves or leave nothing to choose.
    """

    weights: Float
    prices: Float
    positions: Integer
    xyz: Float
    labels: Text
    mandatory: Boolean | None = None
    mandatory_names: Text | None = None
    forbidden: Boolean | None = None
    count: int | None = None
    budget: float | None = None
    min_distance: float = 0.0

    def __post_init__(self) -> None:
        self._check_values()
        self._check_limits()
        for group, name in zip(self.mandatory_groups & self.allowed, self.group_names, strict=True):
            if not group.any():
                raise SeipError(
                    f"{name} must carry a sensor, but every candidate there is forbidden or missing; "
                    "lift one of the two demands or add a candidate there"
                )

    @property
    def allowed(self) -> Boolean:
        """Poses that may be chosen, (c,) bool."""
        return np.ones(len(self.prices), bool) if self.forbidden is None else ~self.forbidden

    @property
    def mandatory_groups(self) -> Boolean:
        """The mandatory groups, (g, c) bool; g is 0 when there are none."""
        return np.zeros((0, len(self.prices)), bool) if self.mandatory is None else self.mandatory

    @property
    def group_names(self) -> list[str]:
        """A name for each mandatory group."""
        if self.mandatory_names is None:
            return [f"mandatory group {index + 1}" for index in range(len(self.mandatory_groups))]
        return [str(name) for name in self.mandatory_names]

    @property
    def most_sensors(self) -> int:
        """The largest number of sensors that number, budget and positions allow."""
        positions, position = np.unique(self.positions[self.allowed], return_inverse=True)
        most = len(positions) if self.count is None else self.count
        if self.budget is None:
            return most
        cheapest = np.full(len(positions), math.inf)
        np.minimum.at(cheapest, position, self.prices[self.allowed])
        affordable = np.count_nonzero(np.cumsum(np.sort(cheapest)) <= self.budget * (1 + TIE_TOLERANCE))
        return min(most, max(1, int(affordable)))

    def _check_values(self) -> None:
        if len(self.prices) == 0:
            raise SeipError("there is no candidate to choose from; add poles or candidate areas")
        if len(self.weights) == 0:
            raise SeipError("there is no target to see; let the region of interest overlap the roads")
        for name, values in (("weight", self.weights), ("price", self.prices)):
            if not np.isfinite(values).all() or (values < 0).any():
                raise SeipError(f"every {name} must be a finite number of at least 0; correct the {name}s")
        if not self.weights.any():
            raise SeipError("the weight of every target is 0; give some target a positive weight")
        if not self.allowed.any():
            raise SeipError("every candidate is forbidden; shrink the forbidden areas")
        if not np.isfinite(self.xyz).all():
            raise SeipError("a candidate's coordinates are not finite; correct the pole or area it stands on")
        if not (math.isfinite(self.min_distance) and self.min_distance >= 0):
            raise SeipError(f"the minimum distance is {self.min_distance} m; give a finite distance of at least 0")

    def _check_limits(self) -> None:
        places = len(np.unique(self.positions[self.allowed]))
        if self.count is not None and self.count < 1:
            raise SeipError(f"the number of sensors is {self.count}; it must be at least 1")
        if self.count is not None and self.count > places:
            raise SeipError(
                f"{self.count} sensors are requested, but there are only {places} positions; request at most {places}"
            )
        cheapest = float(self.prices[self.allowed].min())
        if self.budget is not None and not self.budget >= cheapest:
            raise SeipError(
                f"the budget of {self.budget:g} is below the cheapest sensor, which costs {cheapest:g}; "
                "raise the budget"
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacementProblem(PlacementConstraints):
    r"""The choice of sensors with the largest sum of concave values of targets.

    .. math::
        \max_x \sum_t w_t\, g\Big(\sum_i A_{it} x_i\Big) \quad\text{subject to}\quad
        \sum_i x_i \le N, \quad \sum_i p_i x_i \le C, \quad x_i \in \{0, 1\},

    with at most one pose per position, at least one pose of each mandatory group, and no two poses closer than the
    minimum distance. With A the visibility of the road and :math:`g(x) = \min(x, 1)` it is the maximal covering
    location problem (Church and ReVelle 1974), vanilla if all weights are the same; with A the expected returns from
    road users :math:`g(x) = \ln(1 + x)`.

    Over scenarios k with amounts :math:`A^k` (pose errors, instants of traffic) the objective is the mean of the m
    smallest of the K sums

    .. math::
        F_k(x) = \sum_t w_t\, g\Big(\sum_i A^k_{it} x_i\Big),

    and after the failure of one sensor f it is that of :math:`F_k(x - e_f)`, at worst or on average (`risk`).

    Parameters
    ----------
    amounts : (c, t) bool or float
        A: whether candidate pose i sees target t, or its expected returns from road user t. The other parameters are
        those of `PlacementConstraints`.
    g : Concave
        Value of a target by its amount.

    Examples
    --------
    >>> problem = PlacementProblem(
    ...     weights=np.ones(3), prices=np.array([4_000.0, 8_000.0]), positions=np.array([0, 1]),
    ...     xyz=np.array([[0.0, 0.0, 5.0], [20.0, 0.0, 5.0]]), labels=np.array(["vlp16", "os1_128"]),
    ...     amounts=np.array([[True, False, False], [True, True, False]]), budget=10_000.0,
    ... )
    >>> problem.most_sensors, [problem.value(np.array([pose])) for pose in (0, 1)]
    (1, [1.0, 2.0])
    """

    amounts: NDArray[Any]
    g: Concave = COVERAGE

    def value(self, chosen: Integer) -> float:
        """Return the objective value of chosen candidates: for coverage, the weight that they cover."""
        return math.fsum(self.weights * self.g(self.amounts[chosen].sum(axis=0, dtype=np.float64)))

    def describe_road(self, chosen: Integer, value: float) -> str:
        """Describe a value of coverage for the user; see `solve`."""
        del chosen
        return f"{value / math.fsum(self.weights):.2%} of the road"

    @property
    def nothing_added(self) -> str:
        """Message for a problem in which no candidate adds anything."""
        if self.g == COVERAGE:
            return (
                "no candidate sees any target; try other heights or sensor types, a larger δ, a lower probability of "
                "detection or better weather, or remove obstacles"
            )
        return "no candidate has returns from any road user; try other heights or sensor types, or remove obstacles"


@dataclass(frozen=True, eq=False)
class Placement:
    """Chosen poses with their objective value, bound and gap.

    Parameters
    ----------
    chosen : (k,) int64
        Indices into the problem's candidates, in the order of x, y, z and label.
    objective : float
        Value of what was optimised: the covered weight, or the total price of the cheapest placement for a coverage.
    bound : float
        No placement has a better objective than this.
    gap : float
        ``abs(bound - objective) / objective``; 0 where the two are equal.
    status : str
        ``optimal`` (proven) or ``feasible``.
    solver : str
        Name and version of the solver.
    notes : tuple of str
        Notes on the solution, one sentence each.
    """

    chosen: Integer
    objective: float
    bound: float
    gap: float
    status: str
    solver: str
    price: float
    notes: tuple[str, ...] = ()


def canonical_order(problem: PlacementProblem) -> Integer:
    """Return the indices that sort the candidates by x, y, z and label, (c,) int64."""
    x, y, z = problem.xyz.T
    order: Integer = np.lexsort((problem.prices, problem.labels, z, y, x))
    return order


def assess(  # noqa: PLR0913 -- the fields of one record
    problem: PlacementProblem,
    chosen: Integer,
    objective: float,
    bound: float,
    *,
    optimal: bool,
    solver: str,
    notes: Sequence[str],
) -> Placement:
    """Return a choice with price and certificate."""
    bound = objective if optimal else bound
    return Placement(
        chosen=chosen,
        objective=objective,
        bound=bound,
        gap=problem.g.gap(objective, bound, math.fsum(problem.weights)),
        status="optimal" if optimal else "feasible",
        solver=solver,
        price=math.fsum(problem.prices[chosen]),
        notes=tuple(notes),
    )
