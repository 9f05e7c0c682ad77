r"""Criteria of placements as functions of sets of candidate poses: coverage, returns, and those of the literature.

Notation: S is a set of poses, v a voxel of `voxels` with the share of time p(v) for which a road user is in it, and

.. math::
    h(p) = -p \log_2 p - (1 - p) \log_2 (1 - p)

the entropy in bits of whether one is.
"""

from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Boolean, Float, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.choosing.placement.problem import PlacementProblem

from .vehicle_grid import VIEW_CELLS

_CELLS_AT_ONCE = 1 << 22  # bounds the memory of what is computed for all candidates at once


def entropy(share: Float) -> Float:
    """Return the entropy in bits of what is so likely, element by element."""
    parts = [np.where(p > 0, p * np.log2(np.where(p > 0, p, 1.0)), 0.0) for p in (share, 1 - share)]
    total: Float = -np.sum(parts, axis=0)
    return total


class PoseCriterion(ABC):
    """A figure of any set of candidate poses, the more the better."""

    key: str
    name: str

    @abstractmethod
    def with_each(self, chosen: Integer) -> Float:
        """Return the value of chosen poses with each of the c candidates, (c,)."""

    def value(self, chosen: Integer) -> float:
        """Return the value of one chosen pose or more."""
        return float(self.with_each(chosen[:-1])[chosen[-1]])


@dataclass(frozen=True, eq=False)
class SeenShare(PoseCriterion):
    r"""Weighted share of what some pose sees: :math:`\sum_{v \in \bigcup_{i \in S} V_i} w_v / \sum_v w_v`.

    Parameters
    ----------
    seen : (c, v) bool
        What each pose sees, V.
    weight : (v,) float64
        w.
    """

    key: str
    name: str
    seen: Boolean
    weight: Float

    def with_each(self, chosen: Integer) -> Float:
        """Return the value of chosen poses with each candidate."""
        before = self.seen[chosen].any(axis=0)
        rest = np.flatnonzero(~before & (self.weight > 0))
        added = self.seen[:, rest] @ self.weight[rest]
        total: Float = (added + self.weight[before].sum()) / self.weight.sum()
        return total


@dataclass(frozen=True, eq=False)
class LogReturns(PoseCriterion):
    r"""The returns criterion of the product: the weighted mean of :math:`\ln(1 + \sum_{i \in S} R_{ij})`.

    Parameters
    ----------
    returns : (c, m) float32
        R, expected returns of each pose from each road user, as `returns_grid` has them.
    weight : (m,) float64
        Weight of each road user.
    """

    returns: NDArray[np.float32]
    weight: Float
    key: ClassVar[str] = "returns"  # type: ignore[misc]  # one for all of a class
    name: ClassVar[str] = "returns"  # type: ignore[misc]

    def with_each(self, chosen: Integer) -> Float:
        """Return the value of chosen poses with each candidate."""
        base = self.returns[chosen].sum(axis=0, dtype=np.float64)
        parts = [np.log1p(rows + base) @ self.weight for rows in _blocks(self.returns)]
        total: Float = np.concatenate(parts) / self.weight.sum()
        return total


def entropy_guided_visibility(passed: Boolean, occupancy: Float) -> SeenShare:
    r"""Return the entropy-guided visibility score, EGVS (Jiang et al. 2025, arXiv:2504.06772).

    From the paper: the region is divided into voxels; p(v) is the share of simulated frames in which traffic occupies a
    voxel (traffic probabilistic occupancy grid); the point cloud of an empty frame and the sensor's position give beam
    segments, which are traced through the voxels; the score is the information that the beams capture, by the entropy
    of the voxels that they pass:

    .. math::
        \mathrm{EGVS}(S) = \sum_{v \in \bigcup_{i \in S} V_i} h(p(v)) \Big/ \sum_v h(p(v)).

    Assumed, as the text at hand does not say it: several sensors see the union of their voxels and each voxel counts
    once, the sum is given as a share of what there is, voxels are 1 m high and as wide as the spacing of targets, and
    traffic is all road users. Instead of each beam, one ray is traced to each voxel's middle, and beams pass it where a
    channel does and a return from where the ray ends is likely (`SeenVoxels.passed`).

    Parameters
    ----------
    passed : (c, v) bool
        Voxels that each pose's beams pass, V.
    occupancy : (v,) float64
        p.
    """
    return SeenShare("egvs", "EGVS", passed, entropy(occupancy))


@dataclass(frozen=True, eq=False)
class InfrastructureScore(PoseCriterion):
    r"""Score of coverage, occlusion and information gain, InSPE (Zheng et al. 2025, arXiv:2504.08240), for LiDARs.

    From the paper: three metrics at the level of voxels, of what is in the sensors' frustums (coverage C), of what is
    hidden from them (occlusion O) and of the entropy of traffic's occupancy that they see (information gain IG), are
    fused into one score. The formulas of each, and the weights, are assumed, as the text at hand does not give them:

    .. math::
        C = \frac{|\bigcup F_i|}{|V|}, \quad
        O = 1 - \frac{1}{n} \sum_{t=1}^n \frac{|\bigcup U_{it}|}{|\bigcup F_i|}, \quad
        IG = \frac{\sum_{v \in \bigcup G_i} h(p(v))}{\sum_v h(p(v))}, \quad
        \mathrm{InSPE}(S) = \frac{C + (1 - O) + IG}{3}.

    F are voxels in a sensor's field of view and range, G those of them that the static scene does not hide, U those
    that road users at an instant t do not hide either. Traffic is that of recorded runs, not of waypoints.

    Parameters
    ----------
    covered, free : (c, v) bool
        F and G.
    unhidden : (n, c, v) bool
        U.
    information : (v,) float64
        h(p(v)).
    """

    covered: Boolean
    free: Boolean
    unhidden: Boolean
    information: Float
    key: ClassVar[str] = "inspe"  # type: ignore[misc]
    name: ClassVar[str] = "InSPE"  # type: ignore[misc]

    def with_each(self, chosen: Integer) -> Float:
        """Return the value of chosen poses with each candidate."""
        everything = np.ones(self.covered.shape[1])
        coverage = SeenShare("", "", self.covered, everything).with_each(chosen)
        gain = SeenShare("", "", self.free, self.information).with_each(chosen)
        in_sight = np.mean([SeenShare("", "", one, everything).with_each(chosen) for one in self.unhidden], axis=0)
        unhidden = np.divide(in_sight, coverage, out=np.zeros_like(coverage), where=coverage > 0)
        total: Float = (coverage + unhidden + gain) / 3
        return total


@dataclass(frozen=True, eq=False)
class VehicleGridEntropy(PoseCriterion):
    r"""Perception entropy by vehicle grid occupancy, PE-VGOP (He et al. 2024, arXiv:2407.17942).

    From the paper: the points on a vehicle are taken into its own axes and projected onto its top, side and front view;
    each view is a grid whose cells are occupied or not; the share of occupied cells is the occupancy probability P of
    the view; the metric is the entropy of grid occupancy.

    .. math::
        P_{ja} = \frac{1}{|A_a|} \sum_{g \in A_a} \Big(1 - \prod_{i \in S} m_{ijg}\Big), \qquad
        \mathrm{PE}(S) = \frac{1}{3n} \sum_{j=1}^n \sum_a h\big(\min(P_{ja}, \tfrac12)\big),

    m being the chance that no point of pose i falls into cell g of vehicle j (`vehicle_grid.log_misses`). Assumed, as
    the text at hand does not say it: the number of cells, points in expectation rather than drawn, the mean over views
    and over vehicles at places where recorded traffic drives, and P counted up to one half: beyond that the entropy
    of a share falls, and a view full of points would count as little as an empty one.

    Parameters
    ----------
    log_miss : (c, n, g) float32
        ln m, for the cells of all views one after the other.
    """

    log_miss: NDArray[np.float32]
    key: ClassVar[str] = "pe_vgop"  # type: ignore[misc]
    name: ClassVar[str] = "PE-VGOP"  # type: ignore[misc]

    def with_each(self, chosen: Integer) -> Float:
        """Return the value of chosen poses with each candidate."""
        base = self.log_miss[chosen].sum(axis=0)
        ends = np.cumsum((0, *VIEW_CELLS))
        parts = []
        for rows in _blocks(self.log_miss):
            occupied = -np.expm1(rows + base)
            shares = np.add.reduceat(occupied, ends[:-1], axis=2) / np.diff(ends)
            parts.append(entropy(np.minimum(shares, 0.5).astype(np.float64)).mean(axis=(1, 2)))
        return np.concatenate(parts)


def best_by_greed(criterion: PoseCriterion, problem: PlacementProblem) -> Generator[Progress, None, Integer]:
    """Choose poses greedily by a criterion, then replace each once by the best other one, in turn, (k,) ascending.

    Raises
    ------
    SeipError
        No choice that meets the constraints was found.
    """
    count, chosen = problem.most_sensors, np.zeros(0, dtype=np.int64)
    for done in range(2 * count):
        yield Progress(done, 2 * count, f"choose {count} sensors by {criterion.name}")
        kept = chosen if done < count else np.delete(chosen, 0)  # the first was chosen before all others
        free = _addable(problem, kept, count)
        if free.any():
            best = int(np.argmax(np.where(free, criterion.with_each(kept), -np.inf)))
            chosen = np.append(kept, best)
    if len(chosen) < count or not problem.mandatory_groups[:, chosen].any(axis=1).all():
        raise SeipError(f"{criterion.name} finds no {count} poses that meet the constraints: require fewer positions")
    yield Progress(2 * count, 2 * count, f"chosen by {criterion.name}")
    return np.sort(chosen)


def _addable(problem: PlacementProblem, chosen: Integer, count: int) -> Boolean:
    """Return which candidates can be added to chosen ones: at free positions, and so that all groups can be served."""
    free: Boolean = problem.allowed & ~np.isin(problem.positions, problem.positions[chosen])
    missing = problem.mandatory_groups[~problem.mandatory_groups[:, chosen].any(axis=1)]
    if len(missing) >= count - len(chosen):
        free &= missing.any(axis=0)
    return free


def _blocks(rows: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Return blocks of rows that are small enough for copies."""
    step = max(1, _CELLS_AT_ONCE // max(1, rows[0].size))
    return [rows[begin : begin + step] for begin in range(0, len(rows), step)]
