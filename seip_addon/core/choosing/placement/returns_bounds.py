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

HALVINGS = 8  # of the interval in which the best c of a road user lies
LEAST_SHARE = 0.02  # of the largest one: candidates of a fractional choice below it do not affect the parameters
ROUNDING = 2e-6  # by which single precision may lower a bound, with room to spare
_TABLE = np.concatenate([[0.0], np.geomspace(1e-4, 1e7, 4000)])
_TABLE_INTERCEPT = np.log1p(_TABLE) - _TABLE / (1 + _TABLE)


@dataclass(frozen=True, eq=False)
class ReturnsBound:
    """An upper bound on what the candidates of an instance add to those chosen.

    Parameters
    ----------
    value : float
        No placement adds more.
    fixed : float
        Part of the bound that no candidate contributes.
    selection : Selection
        The candidates of largest contributions.
    """

    value: float
    fixed: float
    selection: Selection


@dataclass(frozen=True, eq=False)
class Completion:
    """What is left to choose where some sensors are chosen.

    Parameters
    ----------
    rules : ReturnsInstance
        Candidates that are left, with the number and the budget that are left.
    base : (m,) float64
        Returns of the chosen sensors.
    """

    rules: ReturnsInstance
    base: Float

    def bound_at(self, t: Float) -> ReturnsBound:
        """Return the bound for parameters t (m,), each at least 0."""
        rules = self.rules
        intercept = np.log1p(t) - t / (1.0 + t)
        linear = (1.0 / ((1.0 + t) * (1.0 + self.base))).astype(np.float32)
        curved = (np.exp(-intercept) / (1.0 + self.base)).astype(np.float32)
        weight = rules.weight.astype(np.float32)
        score = np.empty(len(rules))
        for part in row_blocks(len(rules)):
            rows = rules.returns[part]
            least = rows * curved
            least += np.float32(1.0)
            np.log(least, out=least)
            np.minimum(least, rows * linear, out=least)
            score[part] = least @ weight
        fixed = float(rules.weight @ intercept)
        selection = select(rules, score)
        return ReturnsBound((fixed + selection.value) * (1 + ROUNDING) + ROUNDING, fixed, selection)

    def falling_bounds(self, share: Float) -> Iterator[tuple[ReturnsBound, Float]]:
        """Yield bounds, and the fractional choice of candidates that each follows from.

        The parameters t are those with the smallest bound for a fractional choice; the selection of the bound then
        joins that choice, with a smaller share in each step (Frank and Wolfe 1956).

        Parameters
        ----------
        share : (c,) float64
            Fractional choice to begin from.
        """
        step = 0
        while True:
            bound = self.bound_at(self._parameters(share))
            yield bound, share
            weight = 2.0 / (step + 3.0)
            share = share * (1.0 - weight)
            share[bound.selection.picked] += weight
            step += 1

    def _parameters(self, share: Float) -> Float:
        """Return about the t (m,) with the smallest bound for a fractional choice of candidates.

        The bound is smallest where its derivative by c is zero: where the shares of r/t over small r and of
        r/(exp(c) + r) over large r add up to 1.
        """
        used = np.flatnonzero(share > LEAST_SHARE * share.max())
        part = share[used].astype(np.float32)
        returns = self.rules.returns[used] * (1.0 / (1.0 + self.base)).astype(np.float32)
        low, high = np.zeros(returns.shape[1]), np.log1p(part @ returns).astype(np.float64)
        for _ in range(HALVINGS):
            intercept = (low + high) / 2
            t = np.interp(intercept, _TABLE_INTERCEPT, _TABLE)
            base = np.exp(intercept).astype(np.float32)
            linear = (1.0 / np.maximum(t, _TABLE[1])).astype(np.float32)
            small = returns * (1.0 / (1.0 + t)).astype(np.float32) <= np.log1p(returns / base)
            slope = part @ np.where(small, returns * linear, returns / (base + returns))
            low, high = np.where(slope > 1.0, intercept, low), np.where(slope > 1.0, high, intercept)
        best: Float = np.interp(low, _TABLE_INTERCEPT, _TABLE)
        return best
