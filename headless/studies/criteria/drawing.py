"""Placements of one type and number: the optimal one, random ones, and some in between."""

import functools
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from headless.studies.coverage.cells import Cell, solve_cell
from headless.studies.detection.sensor_configuration import SensorConfiguration

import numpy as np

from seip_addon.core.arrays import Float, Integer
from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, within
from seip_addon.core.workflows.survey import Survey

MIN_PLACEMENTS = 4
MAX_TRIES = 20_000  # draws for one placement before an error states that there are no more
SWAPS_PER_PLACEMENT = 20  # draws from which those in between are taken

NEAR = 0.05  # of the targets: how much less than the optimal placement one near it covers at most

OPTIMAL, RANDOM, BETWEEN, OTHERWISE = "optimal", "random", "in between", "optimal by other criteria"


@dataclass(frozen=True)
class PlacementsStudySettings:
    """Settings of a study of placements.

    Parameters
    ----------
    placements : int
        Evaluated ones, the optimal one included; the optimal ones of other weights come on top.
    count : int
        Sensors of each.
    training_placements : int
        Placements whose clouds the detector learns from; none of them is evaluated.
    trainings : int
        Number of trainings, each with its own seed; with 0 the shipped detector is evaluated, and there are no
        training placements.
    steps : int
        Steps of each training.
    seed : int
        Seed of the drawn placements.
    """

    placements: int
    count: int = 2
    training_placements: int = 12
    trainings: int = 2
    steps: int = 1800
    seed: int = 0

    def check(self, sensors: Sequence[str]) -> None:
        """Raise SeipError where this cannot be studied, before anything is computed.

        Parameters
        ----------
        sensors : sequence of str
            Types to choose from.
        """
        if self.placements < MIN_PLACEMENTS:
            raise SeipError(
                f"{self.placements} placements say nothing of a correlation: ask for {MIN_PLACEMENTS} or more"
            )
        if self.training_placements < 1 <= self.trainings:
            raise SeipError(f"the detector must be trained on 1 placement or more, not {self.training_placements}")
        if self.seed < 0:
            raise SeipError(f"the seed of the placements must be 0 or more, not {self.seed}")
        if len(sensors) != 1:
            raise SeipError(f"placements of one type are compared, not of {' and '.join(sensors)}: name one (--sensor)")


@dataclass(frozen=True, eq=False)
class DrawnPlacements:
    """Placements to be evaluated, and others to learn from.

    Parameters
    ----------
    evaluated : tuple of SensorConfiguration
        The optimal one first.
    kind : tuple of str
        Of each: `OPTIMAL`, `RANDOM`, `BETWEEN`, or `OTHERWISE` for the best one by other weights of targets or by
        another criterion.
    training : tuple of SensorConfiguration
        None of them is among the evaluated.
    """

    evaluated: tuple[SensorConfiguration, ...]
    kind: tuple[str, ...]
    training: tuple[SensorConfiguration, ...]


def draw_placements(
    survey: Survey,
    settings: PlacementsStudySettings,
    weights: Mapping[str, Float],
    best: Mapping[str, Integer] = MappingProxyType({}),
) -> Generator[Progress, None, DrawnPlacements]:
    """Draw placements of a survey's one type.

    The optimal placement is joined by those of other weights and by those that other criteria rate best: random
    placements do not show what these are for.
    Half of the others are drawn uniformly from all feasible sets of poses. Most of these cover about the same; the rest
    are therefore the nearest to given steps of coverage, of many that differ in one sensor from the optimal or from the
    worst placement (greedily, each sensor adds least): half of the steps are even between the two, and half within
    `NEAR` of the optimal, where choices are made. Those to learn from are drawn in the same way, afterwards.

    Parameters
    ----------
    weights : mapping of str to (t,) float64
        Other weights of targets, by name.
    best : mapping of str to (k,) int64
        Poses that other criteria rate best, by name.

    Raises
    ------
    SeipError
        There are fewer placements.
    """
    (sensor,) = survey.models
    site, visible, count = survey.site, survey.grid.visible, settings.count
    yield Progress(0, 2, f"place {count} × {sensor}", counted=False)
    case = yield from solve_cell(site, survey.models, visible, Cell(sensor, None, count, 1.0), survey.settings.limits)
    problem = placement_problem(site, visible, survey.models, Objective(count=count))
    otherwise: dict[frozenset[int], _Found] = {}
    for name, weight in weights.items():
        progress = Progress(1, 2, f"place {count} × {sensor} for {name}", counted=False)
        yield progress
        placement = yield from within(progress, solve(replace(problem, weights=weight), survey.settings.limits))
        if set(placement.chosen.tolist()) != set(case.placement.chosen.tolist()):
            found = _Found(name, placement.chosen, placement.status, placement.gap)
            otherwise.setdefault(frozenset(placement.chosen.tolist()), found)
    for name, poses in best.items():
        if set(poses.tolist()) != set(case.placement.chosen.tolist()):
            otherwise.setdefault(frozenset(poses.tolist()), _Found(name, poses))
    yield Progress(1, 2, "draw placements", counted=False)
    drawing = _Drawing(
        problem,
        count,
        [case.placement.chosen, *(one.chosen for one in otherwise.values())],
        np.random.default_rng(settings.seed),
    )
    random = drawing.random(settings.placements // 2)
    between = drawing.between(settings.placements - 1 - len(random))
    training = drawing.random((settings.training_placements + 1) // 2)
    training += drawing.between(settings.training_placements - len(training))

    def configurations(kind: str, chosen: Sequence[Integer]) -> tuple[SensorConfiguration, ...]:
        return tuple(
            SensorConfiguration(
                f"{kind} {number}", deploy(site, survey.models, visible[poses], poses), sensor, count, kind, np.inf
            )
            for number, poses in enumerate(chosen, start=1)
        )

    optimal = SensorConfiguration.of_case(case)
    others = [
        SensorConfiguration(
            f"optimal for {one.name}",
            deploy(site, survey.models, visible[one.chosen], one.chosen),
            sensor,
            count,
            one.status,
            one.gap,
        )
        for one in otherwise.values()
    ]
    evaluated = (optimal, *configurations(RANDOM, random), *configurations(BETWEEN, between), *others)
    kind = (OPTIMAL, *[RANDOM] * len(random), *[BETWEEN] * len(between), *[OTHERWISE] * len(others))
    yield Progress(2, 2, "placements drawn", counted=False)
    return DrawnPlacements(evaluated, kind, configurations("training", training))


@dataclass(frozen=True, eq=False)
class _Found:
    """Poses that a criterion rates best, as in `Placement`."""

    name: str
    chosen: Integer
    status: str = "feasible"
    gap: float = np.inf


def draw_from_pool(
    problem: PlacementProblem, pool: Integer, best: Sequence[Integer], number: int, random: np.random.Generator
) -> list[tuple[str, Integer]]:
    """Draw placements of few poses, so that each pose is scanned once for many placements; return kind and poses.

    Half are drawn uniformly from the sets of poses of a pool, the others spread as those of `draw_placements`, between
    the greedily worst set of the pool and the first of the best ones.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of most coverage for a number of sensors.
    pool : (p,) int64
        Candidates of which placements consist.
    best : sequence of (k,) int64
        Placements that are not drawn again, the one with the largest coverage first.

    Raises
    ------
    SeipError
        The pool has fewer placements.
    """
    assert problem.count is not None  # noqa: S101  # placements of one number of sensors are drawn
    allowed = np.isin(np.arange(len(problem.positions)), np.concatenate([pool, *best]))
    drawing = _Drawing(replace(problem, forbidden=~(problem.allowed & allowed)), problem.count, best, random)
    uniform = drawing.random((number + 1) // 2)
    between = drawing.between(number - len(uniform))
    return [(RANDOM, poses) for poses in uniform] + [(BETWEEN, poses) for poses in between]


class _Drawing:
    """Draws sets of poses, none twice.

    Parameters
    ----------
    optimal : list of (k,) int64
        Are not drawn again; the first is that of coverage.
    """

    def __init__(
        self, problem: PlacementProblem, count: int, optimal: Sequence[Integer], random: np.random.Generator
    ) -> None:
        self._problem, self._count, self._optimal, self._random = problem, count, optimal[0], random
        self._poses = np.flatnonzero(problem.allowed)
        self._taken = {frozenset(one.tolist()) for one in optimal}

    def random(self, number: int) -> list[Integer]:
        """Draw sets uniformly from all that are feasible."""
        return [self._new(lambda: self._random.choice(self._poses, self._count, replace=False)) for _ in range(number)]

    def between(self, number: int) -> list[Integer]:
        """Draw sets whose coverage is spread from that of the worst to that of the optimal, half of them near that."""
        ends = (self._worst(), self._optimal)
        pool: dict[frozenset[int], float] = {}
        for draw in range(SWAPS_PER_PLACEMENT * number):
            swapped = self._new(functools.partial(self._swapped, ends[draw % 2]), keep=False)
            pool[frozenset(swapped.tolist())] = self._coverage(swapped)
        chosen: list[Integer] = []
        low, high = (self._coverage(end) for end in ends)
        few = number // 2
        levels = np.concatenate(
            [np.linspace(low, high, number - few + 2)[1:-1], high - NEAR * np.arange(few) / (few or 1)]
        )
        for level in levels.tolist():
            if not pool:
                return chosen + self.random(number - len(chosen))
            nearest = min(pool, key=lambda poses: (abs(pool[poses] - level), sorted(poses)))
            del pool[nearest]
            self._taken.add(nearest)
            chosen.append(np.array(sorted(nearest), dtype=np.int64))
        return chosen

    def _new(self, draw: Callable[[], Integer], *, keep: bool = True) -> Integer:
        for _ in range(MAX_TRIES):
            poses = np.sort(draw())
            key = frozenset(poses.tolist())
            if key not in self._taken and self._is_feasible(poses):
                if keep:
                    self._taken.add(key)
                return poses
        raise SeipError(
            f"{MAX_TRIES:,} draws found no more placements of {self._count} sensors than {len(self._taken)}: ask for "
            "fewer placements, or allow more positions and heights"
        )

    def _is_feasible(self, poses: Integer) -> bool:
        positions = self._problem.positions[poses]
        return len(set(positions.tolist())) == self._count and bool(
            self._problem.mandatory_groups[:, poses].any(axis=1).all()
        )

    def _swapped(self, poses: Integer) -> Integer:
        """Return poses with one of them replaced by a random one, or with random ones added."""
        kept = self._random.permutation(poses)[: self._count - 1]
        return np.append(kept, self._random.choice(self._poses, self._count - len(kept), replace=False))

    def _worst(self) -> Integer:
        """Return poses that each see something, and each add least to those before them."""
        visible, positions = self._problem.visible, self._problem.positions
        free = self._poses[visible[self._poses].any(axis=1)]
        seen = np.zeros(visible.shape[1], dtype=bool)
        chosen: list[int] = []
        while len(chosen) < self._count and len(free):
            chosen.append(int(free[np.argmin(np.count_nonzero(visible[free] & ~seen, axis=1))]))
            seen |= visible[chosen[-1]]
            free = free[positions[free] != positions[chosen[-1]]]
        return np.array(chosen, dtype=np.int64)

    def _coverage(self, poses: Integer) -> float:
        return float(self._problem.visible[poses].any(axis=0).mean())
