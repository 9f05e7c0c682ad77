r"""Upper bounds on the value of a placement by expected returns.

For one road user and any :math:`t \ge 0` let

.. math::
    c = \ln(1 + t) - \frac{t}{1 + t}, \qquad
    a(r) = \min\Big(\frac{r}{1 + t},\; \ln(e^{c} + r) - c\Big).

Every set of poses with returns :math:`r_1, r_2, …` from the road user has

.. math::
    \ln\Big(1 + \sum_i r_i\Big) \le c + \sum_i a(r_i).

Proof. Let :math:`g(s) = \ln(1 + s)` and :math:`θ = e^c - 1`, so that :math:`g(θ) = c`. Call :math:`r_i` small where
the first term of a is the smaller one. The small ones add up to s. If all are small, the tangent of g at t gives
:math:`g(s) \le g(t) + (s - t)/(1 + t) = c + s/(1 + t)`. Otherwise let L be the sum of the large ones. As g is concave,

.. math::
    g(L + s) \le g(θ + L + s) \le g(θ) + \sum_{large} [g(θ + r_i) - g(θ)] + s\, g'(θ + L),

and :math:`g'(θ + L) \le 1/(1 + t)`: for a large :math:`r_i` the mean slope of g from θ to :math:`θ + r_i` is at most
:math:`1/(1 + t)`, and the slope at the end of a concave function is at most the mean.

The sum over road users, each with a t of its own, is linear in the poses. Its largest value over the placements
(`bounds.select`) is a bound. The tangent alone gives the bound of the continuous relaxation, which spreads returns
thinly over many poses: for two OS1-128 at the shipped junction it is 12 % above the best value, and this one 1 %.

Where sensors are chosen already, :math:`\ln(1 + b + s) = \ln(1 + b) + \ln(1 + s/(1 + b))`: returns count as shares of
one more than those there are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Float
from .bounds import Selection, select
from .returns_instance import ReturnsInstance, row_blocks
from .search_limits import Clock

HALVINGS = 8  # halvings of the interval in which the best c of a road user lies
LEAST_SHARE = 0.02  # candidates with less than this part of the largest share in a choice do not affect the parameters
ROUNDING = 2e-6  # relative and absolute error that single precision may cause in a bound, with room to spare
OPERATIONS_PER_LOGARITHM = 20  # multiplications that take as long as one logarithm in a row of returns
OPERATIONS_PER_SLOPE = 40  # those that take as long as the slope at one entry, in one halving of the interval
OPERATIONS_PER_LOOKUP = 340  # those that take as long as looking up one parameter in the table, in one halving
_TABLE = np.concatenate([[0.0], np.geomspace(1e-4, 1e7, 4000)])
_TABLE_INTERCEPT = np.log1p(_TABLE) - _TABLE / (1 + _TABLE)


@dataclass(frozen=True, eq=False)
class ReturnsBound:
    """An upper bound on the value that the candidates of an instance add to a choice.

    Parameters
    ----------
    value : float
        Upper bound on what any placement adds.
    selection : Selection
        The candidates of largest contributions.
    """

    value: float
    selection: Selection


@dataclass(frozen=True, eq=False)
class Completion:
    """Remaining choice after some sensors have been chosen.

    Parameters
    ----------
    rules : ReturnsInstance
        Candidates that are left, with the number of sensors and the budget that are left.
    base : (m,) float64
        Returns of the chosen sensors.
    """

    rules: ReturnsInstance
    base: Float

    def bound_at(self, t: Float) -> ReturnsBound:
        """Return the bound for parameters t (m,), each at least 0."""
        # The bound c + Σ a(r_i) of each road user, with returns as shares r/(1 + base). Both terms of a are written so
        # that one factor per road user is left: the tangent r/(1 + t), and ln(e^c + r) - c = ln(1 + r e^-c).
        rules = self.rules
        intercept = np.log1p(t) - t / (1.0 + t)
        linear = (1.0 / ((1.0 + t) * (1.0 + self.base))).astype(np.float32)
        curved = (np.exp(-intercept) / (1.0 + self.base)).astype(np.float32)
        weight = rules.weight.astype(np.float32)
        score = np.empty(len(rules))
        for part in row_blocks(len(rules)):
            # a few rows at a time stay in the processor's cache; the steps work in place for the same reason
            rows = rules.returns[part]
            least = rows * curved
            least += np.float32(1.0)
            np.log(least, out=least)
            np.minimum(least, rows * linear, out=least)
            score[part] = least @ weight
        # linear in the poses: the best choice under number, budget and cliques is a matter of sorting
        fixed = float(rules.weight @ intercept)
        selection = select(rules, score)
        # single precision may have made the scores too small, and a bound must not be
        return ReturnsBound((fixed + selection.value) * (1 + ROUNDING) + ROUNDING, selection)

    def falling_bounds(self, share: Float, clock: Clock) -> Iterator[tuple[ReturnsBound, Float]]:
        """Yield bounds, each with the fractional choice of candidates from which it was computed.

        The parameters t minimise the bound for a fractional choice. The selection of that bound then joins the choice,
        with a smaller share in each step (Frank and Wolfe 1956).

        Parameters
        ----------
        share : (c,) float64
            Fractional choice to begin from.
        clock : Clock
            Clock on which each bound is recorded as work.
        """
        # The smallest bound over t is a minimum over t of a maximum over choices. Each t gives a valid bound, however
        # rough the fractional choice is: it only decides how small the bound becomes, never whether it holds.
        step = 0
        while True:
            bound = self.bound_at(self._parameters(share, clock))
            clock.spend(OPERATIONS_PER_LOGARITHM * self.rules.returns.size)
            yield bound, share
            weight = 2.0 / (step + 3.0)
            share = share * (1.0 - weight)
            share[bound.selection.picked] += weight
            step += 1

    def _parameters(self, share: Float, clock: Clock) -> Float:
        """Return nearly the parameters t (m,) that minimise the bound for a fractional choice of candidates.

        The bound is smallest where its derivative by c is zero: where r/t of small r and r/(exp(c) + r) of large r,
        weighted by the shares, add up to 1.
        """
        # From dc/dt = t/(1 + t)² the derivative of r/(1 + t) by c is -r/t, and that of ln(e^c + r) - c is -r/(e^c + r);
        # c itself gives 1. Each of these terms falls as c grows, so that bisection leads near the zero. c is searched
        # in place of t, since it lies between 0 and ln(1 + Σ r). The table inverts c(t), which has no closed form.
        # Candidates with hardly any share are left out, as they would make up most of the work.
        used = np.flatnonzero(share > LEAST_SHARE * share.max())
        part = share[used].astype(np.float32)
        returns = self.rules.returns[used] * (1.0 / (1.0 + self.base)).astype(np.float32)
        low, high = np.zeros(returns.shape[1]), np.log1p(part @ returns).astype(np.float64)
        clock.spend(HALVINGS * (OPERATIONS_PER_SLOPE * returns.size + OPERATIONS_PER_LOOKUP * returns.shape[1]))
        for _ in range(HALVINGS):
            intercept = (low + high) / 2
            t = np.interp(intercept, _TABLE_INTERCEPT, _TABLE)
            base = np.exp(intercept).astype(np.float32)
            # t = 0 would divide by zero
            linear = (1.0 / np.maximum(t, _TABLE[1])).astype(np.float32)
            small = returns * (1.0 / (1.0 + t)).astype(np.float32) <= np.log1p(returns / base)
            slope = part @ np.where(small, returns * linear, returns / (base + returns))
            low, high = np.where(slope > 1.0, intercept, low), np.where(slope > 1.0, high, intercept)
        best: Float = np.interp(low, _TABLE_INTERCEPT, _TABLE)
        return best
