"""Reference line of a road in plan: lines, arcs, clothoids and cubic curves.

All follow ASAM OpenDRIVE 1.8, section "Geometry". A piece of any kind is evaluated at distances along it, to well below
a nanometre.

A piece is a curve of unit speed: with heading θ(s), its position is the integral of (cos θ, sin θ) from 0 to s. Only
lines and arcs have a closed form. The integrals of the others are computed by Gauss-Legendre quadrature with 16 nodes
on panels short enough for rounding to be the only error. The remainder on a panel of length h is
``h³³ (16!)⁴ / (33 (32!)³) · f⁽³²⁾``, about 3e-55 times the 32nd derivative of the integrand on the unit interval
(Abramowitz and Stegun, Handbook of Mathematical Functions, 25.4.30).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...base.arrays import Float

_ROOTS, _ROOT_WEIGHTS = np.polynomial.legendre.leggauss(16)  # type: ignore[no-untyped-call]  # numpy 1.26 has no types here
# Nodes and weights of numpy are for [-1, 1]; these are for the unit interval.
_NODES: Float = (_ROOTS + 1.0) / 2.0
_WEIGHTS: Float = _ROOT_WEIGHTS / 2.0
_CUBIC_PANELS = 64  # panels of p on which the arc length of a cubic is tabulated


class Piece(Protocol):
    """One ``<geometry>``: a curve that starts at the origin and is evaluated along its length."""

    def __call__(self, distance: Float) -> tuple[Float, Float, Float]:
        """Return local x, y and heading, (k,) each, at distances (k,) from the start."""


@dataclass(frozen=True)
class Clothoid:
    """Curve whose curvature changes linearly with its length; lines and arcs are such curves too.

    Parameters
    ----------
    curvature : float, 1/m
        Curvature at the start, positive to the left.
    rate : float, 1/m²
        Change of the curvature per metre.
    """

    curvature: float
    rate: float

    def __call__(self, distance: Float) -> tuple[Float, Float, Float]:
        """Return local x, y and heading, (k,) each, at distances (k,) from the start."""
        # the integral of the curvature κ(s) = κ₀ + c s is the heading θ(s) = κ₀ s + c s² / 2
        heading = distance * (self.curvature + distance * self.rate / 2.0)
        if self.rate == 0.0:
            # Line or arc. The chord of an arc of length s that turns by θ has the heading θ/2 and the length
            # s sin(θ/2) / (θ/2). np.sinc(x) is sin(πx) / (πx) and 1 at 0: no division by the curvature of a line.
            chord = distance * np.sinc(heading / (2.0 * np.pi))
            return chord * np.cos(heading / 2.0), chord * np.sin(heading / 2.0), heading
        # Fresnel integrals, over panels in which the curve turns by at most a radian. There cos θ and sin θ have no
        # oscillation that 16 nodes could miss. A series or the standard Fresnel functions would need a case for rates
        # near zero, where their scale 1/√c is infinite.
        farthest = float(np.max(distance, initial=0.0))
        panels = 1 + int(self.turn(farthest))
        size = farthest / panels or 1.0
        knots = size * np.arange(panels)
        panel = np.minimum(distance // size, panels - 1).astype(np.int64)  # that of the end would be one too many
        whole = self._displacement(knots, np.full(panels, size))
        before = np.cumsum(whole, axis=1) - whole  # displacement from the start of the piece to each knot
        x, y = before[:, panel] + self._displacement(knots[panel], distance - knots[panel])
        return x, y, heading

    def _displacement(self, start: Float, length: Float) -> Float:
        """Return the displacements (2, k), metres, over lengths in which the curve turns by at most a radian."""
        along = start[:, None] + length[:, None] * _NODES
        heading = along * (self.curvature + along * self.rate / 2.0)
        return np.stack([length * (np.cos(heading) @ _WEIGHTS), length * (np.sin(heading) @ _WEIGHTS)])

    def turn(self, length: float) -> float:
        """Return an upper bound on the angle (radians) that the curve turns through over a length."""
        # the curvature is linear, so its magnitude is greatest at one of the ends
        return length * max(abs(self.curvature), abs(self.curvature + length * self.rate))


@dataclass(frozen=True, eq=False)
class Cubic:
    """Plane curve ``(u(p), v(p))`` of two cubic polynomials, evaluated at distances along it.

    Parameters
    ----------
    u, v : (4,) float64
        Coefficients of 1, p, p², p³.
    parameters : (m,) float64
        Knots on the range of p.
    distances : (m,) float64, metres
        Arc length from the start to each knot.
    stretch : float
        Metres of arc per metre of road.
    """

    u: Float
    v: Float
    parameters: Float
    distances: Float
    stretch: float

    def __call__(self, distance: Float) -> tuple[Float, Float, Float]:
        """Return local x, y and heading, (k,) each, at distances (k,) from the start."""
        p = self._parameter(np.clip(distance * self.stretch, 0.0, self.distances[-1]))
        powers = p[:, None] ** np.arange(4)
        du, dv = _derivative(self.u, p), _derivative(self.v, p)
        return powers @ self.u, powers @ self.v, np.arctan2(dv, du)

    def _parameter(self, arc: Float) -> Float:
        """Invert the arc length by Newton's method, safeguarded by bisection (Press et al., Numerical Recipes, 9.4)."""
        # The table brackets p between two knots. The arc is integrated from the lower knot, over less than a panel.
        panel = np.clip(np.searchsorted(self.distances, arc, side="right") - 1, 0, len(self.distances) - 2)
        low, high = self.parameters[panel], self.parameters[panel + 1]
        first, base = low, self.distances[panel]
        p = np.interp(arc, self.distances, self.parameters)
        # Arc length increases with p, so the sign of the excess tells which end of the bracket to move. Its derivative
        # is the speed √(u'² + v'²). A Newton step that leaves the bracket, or divides by a speed of zero (a cusp), is
        # replaced by halving the bracket: 60 halvings reach the spacing of floating-point numbers in any case.
        for _ in range(60):
            excess = base + _arc_length(self.u, self.v, first, p) - arc
            low, high = np.where(excess <= 0.0, p, low), np.where(excess >= 0.0, p, high)
            speed = np.hypot(_derivative(self.u, p), _derivative(self.v, p))
            step = p - np.divide(excess, speed, out=np.full_like(p, np.inf), where=speed > 0.0)
            following = np.where((step >= low) & (step <= high), step, (low + high) / 2.0)
            if np.all(np.abs(following - p) <= 1e-15 * self.parameters[-1]):
                return following
            p = following
        return p


def poly3(coefficients: tuple[float, float, float, float], length: float) -> Cubic:
    """Return the curve ``v = a + b·u + c·u² + d·u³`` from u = 0 over a length."""
    # The arc is never shorter than its projection onto u, so p = u = length is far enough for every distance.
    return _cubic(np.array([0.0, 1.0, 0.0, 0.0]), np.array(coefficients), length)


def param_poly3(
    u: tuple[float, float, float, float], v: tuple[float, float, float, float], end: float, length: float
) -> Cubic:
    """Return the parametric cubic with p from 0 to ``end`` (1 or the length) over a length of road.

    The standard relates p to s only at both ends; in between, s is the distance along the curve. If the length of the
    arc differs from the stated length, s is stretched.
    """
    curve = _cubic(np.array(u), np.array(v), end)
    return Cubic(curve.u, curve.v, curve.parameters, curve.distances, float(curve.distances[-1]) / length)


def _cubic(u: Float, v: Float, end: float) -> Cubic:
    parameters = np.linspace(0.0, end, _CUBIC_PANELS + 1)
    lengths = _arc_length(u, v, parameters[:-1], parameters[1:])
    return Cubic(u, v, parameters, np.concatenate([[0.0], np.cumsum(lengths)]), 1.0)


def _derivative(polynomial: Float, p: Float) -> Float:
    """Return the derivative of a cubic, by Horner's rule."""
    return np.asarray(polynomial[1] + p * (2.0 * polynomial[2] + p * 3.0 * polynomial[3]))


def _arc_length(u: Float, v: Float, start: Float, end: Float) -> Float:
    """Return the integrals of √(u'² + v'²) from each start to each end in p, (k,) float64, metres."""
    p = start[:, None] + (end - start)[:, None] * _NODES
    return np.asarray((end - start) * (np.hypot(_derivative(u, p), _derivative(v, p)) @ _WEIGHTS))


@dataclass(frozen=True, eq=False)
class ReferenceLine:
    """Sequence of pieces, each with its own start in map coordinates.

    Parameters
    ----------
    s : (n,) float64, metres
        Start of each piece along the road, ascending.
    length : (n,) float64, metres
        Length of each piece.
    start : (n, 3) float64
        x, y in metres and heading in radians of each piece's start.
    """

    s: Float
    length: Float
    start: Float
    pieces: tuple[Piece, ...]

    @property
    def end(self) -> float:
        """End of the last piece, metres along the road."""
        return float(self.s[-1] + self.length[-1])

    def __call__(self, s: Float) -> tuple[Float, Float, Float]:
        """Return x, y and heading, (k,) each, at ``s``, (k,) metres along the road."""
        x, y, heading = np.empty_like(s), np.empty_like(s), np.empty_like(s)
        index = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 1)
        for i in np.unique(index):
            here = index == i
            x0, y0, heading0 = self.start[i]
            along, aside, heading[here] = self.pieces[i](np.clip(s[here] - self.s[i], 0.0, self.length[i]))
            # rotated by the heading of the piece's start, then moved there
            x[here] = x0 + along * np.cos(heading0) - aside * np.sin(heading0)
            y[here] = y0 + along * np.sin(heading0) + aside * np.cos(heading0)
            heading[here] += heading0
        return x, y, heading
