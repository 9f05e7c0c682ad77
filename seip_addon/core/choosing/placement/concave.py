r"""Concave values of targets, and sums of them over targets.

A target t with the amount :math:`x_t = \sum_{i \in S} A_{it}` from the chosen sensors S has the value :math:`g(x_t)`, g
being concave and increasing with g(0) = 0. The value of a placement is

.. math::
    F(S) = \sum_t w_t \, g\Big(\sum_{i \in S} A_{it}\Big),

which is monotone and submodular. `ConcaveSum` computes F, the gains of further sensors, and upper bounds on F that are
linear in the sensors. For a slope σ let :math:`c(σ) = \max_x g(x) - σ x` be the intercept of the tangent of that slope.
With b of the amount given, :math:`C = c(σ) + σ b`, and h such that g(h) = C, every set of further sensors with the
amounts :math:`r_1, r_2, …` has

.. math::
    g\Big(b + \sum_i r_i\Big) \le C + \sum_i a(r_i), \qquad a(r) = \min\big(σ r,\; g(h + r) - g(h)\big).

Proof. Let s be the sum of the small :math:`r_i`, where the first term of a is the smaller one, and L that of the
others. Without large ones the tangent is the bound. Otherwise :math:`b \le h` gives
:math:`g(b + L + s) \le g(h + L) + s\,g'(h + L)`; the increments of a concave function give
:math:`g(h + L) \le C + \sum_{large} [g(h + r_i) - g(h)]`; and :math:`g'(h + L) \le σ`, since the mean slope from h to
:math:`h + r_i` is at most σ for a large :math:`r_i`, and the slope at the end of an interval is at most the mean.

For coverage this is the Lagrangian relaxation (Galvão and ReVelle 1996). For the logarithm the tangents alone would be
the continuous relaxation, which spreads amounts thinly over many sensors; the second term of a avoids much of that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer

ROWS_AT_ONCE = 16  # rows that stay in a processor's cache
SINGLE_ROUNDING = 1e-5  # share of a sum of single-precision products by which it may be wrong
DOUBLE_ROUNDING = 1e-11  # the same for double precision
MAX_UPDATES, UPDATED_SHARE = 100, 0.3  # updates of earlier results in a row, and share of targets that may change


@dataclass(frozen=True)
class Steps:
    """A concave function g of the number of sensors that see a target, linear between whole numbers; g(0) = 0.

    Parameters
    ----------
    rises : tuple of float
        What the first sensor adds, the second and so on, in falling order; further ones add nothing.
    """

    rises: tuple[float, ...] = (1.0,)

    def __call__(self, x: Float) -> Float:
        """Return g(x)."""
        levels = [rise * np.clip(x - level, 0.0, 1.0) for level, rise in enumerate(self.rises)]
        value: Float = np.sum(levels, axis=0)
        return value

    def sum_over(self, amounts: NDArray[Any], weight: Float, *, single: bool) -> ConcaveSum:
        """Return F for amounts (c, t) bool and weights (t,), in single precision if that is enough."""
        return StepSum(amounts.astype(np.float32 if single else np.float64, order="C"), weight, self)

    def gap(self, value: float, bound: float, weight: float) -> float:  # noqa: ARG002 -- as of the other function
        """Return the gap of a value of F to a bound: their distance as a share of the value."""
        return relative_gap(value, bound)


@dataclass(frozen=True)
class Logarithm:
    """The value g(x) = ln(1 + x) of returns: each further return is worth less than the one before."""

    def __call__(self, x: Float) -> Float:
        """Return ln(1 + x)."""
        value: Float = np.log1p(x)
        return value

    def sum_over(self, amounts: NDArray[Any], weight: Float, *, single: bool) -> ConcaveSum:  # noqa: ARG002 -- as of the other function
        """Return F for amounts (c, t) float and weights (t,)."""
        return LogSum(np.ascontiguousarray(amounts, dtype=np.float32), weight, self)

    def gap(self, value: float, bound: float, weight: float) -> float:
        """Return the share by which the geometric mean of 1 + x may be larger."""
        return math.expm1(max(0.0, bound - value) / weight)


Concave = Steps | Logarithm
COVERAGE, LOG_RETURNS = Steps(), Logarithm()


def relative_gap(value: float, bound: float) -> float:
    """Return the distance of a bound from a value, as a share of the value."""
    if bound == value:
        return 0.0
    return abs(bound - value) / value if value > 0 else math.inf


@dataclass(frozen=True, eq=False)
class _Sum:
    """F over c candidates and t targets: what is the same for every g.

    Parameters
    ----------
    amounts : (c, t) float32 or float64
        A.
    weight : (t,) float64
        w.
    g : Concave
    """

    amounts: NDArray[np.floating[Any]]
    weight: Float
    g: Concave

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.amounts)

    def of(self, keep: Integer, targets: Integer | None = None) -> Self:
        """Return the sum for some of the candidates, and some of the targets."""
        if targets is None or len(targets) == len(self.weight):
            return type(self)(self.amounts[keep], self.weight, self.g)
        return type(self)(self.amounts[keep].take(targets, axis=1), self.weight[targets], self.g)

    def together(self, chosen: Integer) -> Float:
        """Return the amounts of chosen candidates together at each target, (t,) float64."""
        together: Float = self.amounts[chosen].sum(axis=0, dtype=np.float64)
        return together

    def value_at(self, base: Float) -> float:
        """Return F for amounts at the targets (t,)."""
        return float(self.weight @ self.g(base))

    def value(self, chosen: Integer) -> float:
        """Return F of chosen candidates."""
        return self.value_at(self.together(chosen))

    @property
    def rounding(self) -> float:
        """Largest rounding error of gains and bounds."""
        share = SINGLE_ROUNDING if self.amounts.dtype == np.float32 else DOUBLE_ROUNDING
        return share * (float(self.weight.sum()) + self.value_at(self.together(np.arange(len(self)))))

    def open_targets(self, base: Float) -> Integer:
        """Return the targets to which further sensors may add anything."""
        return np.arange(len(base))


class _LastGains:
    """The last result of `StepSum.gains`.

    Attributes
    ----------
    each : (t,) float64
        What one sensor more adds at each target.
    gains : (c,) float64
    uses : int
        Number of results since the last one that was computed in full.
    """

    def __init__(self) -> None:
        self.each: Float = np.zeros(0)
        self.gains: Float = np.zeros(0)
        self.uses = 0


@dataclass(frozen=True, eq=False)
class StepSum(_Sum):
    """F of `Steps`: its bound's parameters are negative slopes."""

    g: Steps
    _last: _LastGains = field(default_factory=_LastGains, repr=False)

    @property
    def operations(self) -> float:
        """Number of multiplications that take as long as all scores: a product of a matrix and a vector."""
        return 0.6 * self.amounts.size

    @property
    def update_operations(self) -> float:
        """Number of multiplications that take as long as `gains` after those of a similar choice: the changed part."""
        return 0.15 * self.amounts.size

    @cached_property
    def by_target(self) -> NDArray[np.floating[Any]]:
        """Amounts by target, (t, c)."""
        return np.ascontiguousarray(self.amounts.T)

    @cached_property
    def _bytes(self) -> NDArray[np.uint8]:
        return self.amounts.astype(np.uint8)

    def of(self, keep: Integer, targets: Integer | None = None) -> Self:
        """Return the sum for some of the candidates and targets; gathering bytes takes half the time of floats."""
        if targets is None:
            return super().of(keep)
        amounts = self._bytes[keep].take(targets, axis=1).astype(self.amounts.dtype)
        return type(self)(amounts, self.weight[targets], self.g)

    def together(self, chosen: Integer) -> Float:
        """Return how many of the chosen candidates see each target: small whole numbers, exact in any precision."""
        together: Float = (np.ones(len(chosen), self.amounts.dtype) @ self.amounts[chosen]).astype(np.float64)
        return together

    def _rise(self, base: Float) -> Float:
        """Return what one sensor more adds to targets seen ``base`` times."""
        rises = np.array([*self.g.rises, 0.0])
        rise: Float = rises[np.minimum(base.astype(np.int64), len(rises) - 1)]
        return rise

    def _product(self, each: Float) -> Float:
        product: Float = (self.amounts @ each.astype(self.amounts.dtype)).astype(np.float64)
        return product

    def gains(self, base: Float) -> Float:
        """Return the weight of the targets that each candidate adds.

        In a search successive calls differ at few targets: only their part of the last result is computed again.
        """
        each, last = self.weight * self._rise(base), self._last
        changed = np.flatnonzero(each != last.each) if last.uses else np.zeros(0)
        if 0 < last.uses < MAX_UPDATES and len(changed) < UPDATED_SHARE * len(each):
            if len(changed):
                difference = (each - last.each)[changed].astype(self.amounts.dtype)
                last.gains = last.gains + (difference @ self.by_target[changed]).astype(np.float64)
        else:
            last.gains, last.uses = self._product(each), 0
        last.each, last.uses = each, last.uses + 1
        return last.gains.copy()

    def gains_after(self, base: Float, first: Integer) -> Float:
        """Return the gains less the weight that each of some candidates takes away from each other one, (k, c)."""
        lost = (self.weight * (self._rise(base) - self._rise(base + 1.0))).astype(self.amounts.dtype)
        after: Float = self.gains(base) - ((self.amounts[first] * lost) @ self.amounts.T).astype(np.float64)
        return after

    def open_targets(self, base: Float) -> Integer:
        """Return the targets that are not seen often enough yet."""
        return np.flatnonzero(self._rise(base) > 0)

    def lowest(self, base: Float) -> Float:
        """Return the smallest parameters of a bound, (t,): the negative slope at the number of sensors given."""
        return -self._rise(base)

    def start(self, base: Float) -> Float:
        """Return lower slopes for targets that many candidates see, as several of those chosen are likely to."""
        del base
        start: Float = -self.g.rises[0] / np.sqrt(np.maximum(1.0, self.amounts.sum(axis=0, dtype=np.float64)))
        return start

    def bound(self, base: Float, parameters: Float) -> tuple[float, Float]:
        """Return the bound: a constant, and what each candidate adds, the slopes of the targets that it sees, (c,)."""
        slope = -parameters
        # the tangent of a slope touches where the next step is smaller: its value at the number of sensors given
        reached, level = self.g(base), base
        above = np.zeros(len(base))
        for _ in self.g.rises:
            above += np.maximum(self._rise(level) - slope, 0.0)
            level = level + 1.0
        return float(self.weight @ (reached + above)), self._product(self.weight * slope)

    def slope(self, base: Float, parameters: Float, picked: Integer) -> Float:
        """Return the derivative of the bound with the picked candidates by each parameter, per unit of weight, (t,).

        It is the number of sensors by which the tangent is above the base, less the number of those picked that see the
        target, and 0 where a smaller bound is beyond the limits of a parameter.
        """
        slope, level = -parameters, base
        steps = np.zeros(len(base))
        for _ in self.g.rises:
            steps += self._rise(level) > slope
            level = level + 1.0
        # where steps equal the slope any number of them counts: the one that leaves the derivative nearest to zero
        more = np.zeros(len(base))
        level = base
        for _ in self.g.rises:
            more += self._rise(level) >= slope
            level = level + 1.0
        more[slope <= 0.0] = np.inf
        seen = self.together(picked)
        return np.clip(seen, steps, more) - seen

    def clipped(self, base: Float, parameters: Float) -> Float:
        """Return parameters between the slope at the base and 0."""
        return np.clip(parameters, self.lowest(base), 0.0)


@dataclass(frozen=True, eq=False)
class LogSum(_Sum):
    """F of `Logarithm`: its bound's parameters are ln(1 + x) at the points of the tangents, or -ln σ."""

    @property
    def operations(self) -> float:
        """A logarithm of each amount."""
        return 5.0 * self.amounts.size

    @property
    def update_operations(self) -> float:
        """Logarithms, without the comparison with tangents."""
        return 2.0 * self.amounts.size

    def gains(self, base: Float) -> Float:
        """Return the weighted logarithms of the ratios by which each candidate raises 1 + x."""
        return self._scores((1.0 / (1.0 + base)).astype(np.float32), None)

    def lowest(self, base: Float) -> Float:
        """Return ln(1 + base)."""
        return np.log1p(base)

    def start(self, base: Float) -> Float:
        """Return somewhat less than the logarithm of the amounts of a good placement."""
        start: Float = 0.8 * np.log1p(base)
        return start

    def _tangents(self, base: Float, parameters: Float) -> tuple[Float, Float]:
        """Return slopes σ and values C of the tangents at the base."""
        slope = np.exp(-parameters)
        return slope, parameters - 1.0 + slope * (1.0 + base)

    def bound(self, base: Float, parameters: Float) -> tuple[float, Float]:
        """Return the bound, in which each candidate adds the smaller one of tangent and curve at each target."""
        slope, at = self._tangents(base, parameters)
        return float(self.weight @ at), self._scores(np.exp(-at).astype(np.float32), slope.astype(np.float32))

    def _scores(self, curved: NDArray[np.float32], linear: NDArray[np.float32] | None) -> Float:
        """Return the weighted sums of min(A·linear, ln(1 + A·curved)), (c,)."""
        weight, scores = self.weight.astype(np.float32), np.empty(len(self))
        for first in range(0, len(self), ROWS_AT_ONCE):
            part = slice(first, first + ROWS_AT_ONCE)
            rows = self.amounts[part]
            least = rows * curved
            least += np.float32(1.0)
            np.log(least, out=least)
            if linear is not None:
                np.minimum(least, rows * linear, out=least)
            scores[part] = least @ weight
        return scores

    def slope(self, base: Float, parameters: Float, picked: Integer) -> Float:
        """Return the derivative; the curve's is C' (g'(h + r)/g'(h) - 1) with g'(h + r)/g'(h) = 1/(1 + r/(1 + h))."""
        slope, at = self._tangents(base, parameters)
        amount = self.amounts[picked].astype(np.float64)
        ratio, linear = amount * np.exp(-at), amount * slope
        rising = 1.0 - slope * (1.0 + base)  # C'
        curved = np.log1p(ratio) < linear
        derivative: Float = rising - np.where(curved, rising * ratio / (1.0 + ratio), linear).sum(axis=0)
        at_limit = (parameters <= self.lowest(base)) & (derivative > 0)
        derivative[at_limit] = 0.0
        return derivative

    def clipped(self, base: Float, parameters: Float) -> Float:
        """Return parameters of at least ln(1 + base)."""
        clipped: Float = np.maximum(parameters, self.lowest(base))
        return clipped


ConcaveSum = StepSum | LogSum
