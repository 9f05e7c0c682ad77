"""One function places sensors for every criterion, scenario and risk measure."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import ACCEPTED_MESSAGE, Objective
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.sensing.scenarios.pose_errors import PoseErrors
from seip_addon.core.workflows.moved_sensors import evaluate_moved_sensors
from seip_addon.core.workflows.placing import place, with_context


def best_of_all(survey, count, worth):
    """Largest worth of all choices of so many poses at different positions."""
    position = survey.site.candidates.position_of
    return max(
        worth(list(chosen))
        for chosen in combinations(range(len(position)), count)
        if len(set(position[list(chosen)])) == count
    )


def test_the_nominal_placement_covers_most_of_all_choices(small_survey):
    seen = small_survey.grid.visible
    solution = finish(place(small_survey, Objective(count=2)))
    assert solution.placement.status == "optimal"
    assert solution.placement.objective == best_of_all(small_survey, 2, lambda chosen: seen[chosen].any(axis=0).sum())
    assert solution.evaluation is None


def test_the_worst_failure_leaves_most_of_all_choices(small_survey):
    """Of two sensors the worse one is left after the failure of the other."""
    seen = small_survey.grid.visible
    solution = finish(place(small_survey, Objective(count=2, failures="worst")))
    best = best_of_all(small_survey, 2, lambda chosen: seen[chosen].sum(axis=1).min())
    assert solution.placement.objective == pytest.approx(best)
    assert solution.evaluation is not None


def test_pose_errors_are_evaluated_on_held_out_scenarios(small_survey):
    errors = Scenarios(kind="pose-errors", pose_errors=PoseErrors(position=0.3), count=4, held_out=12)
    solution = finish(place(small_survey, Objective(count=1, scenarios=errors)))
    assert solution.evaluation is not None
    assert any("4 scenarios" in note for note in solution.placement.notes)
    nominal = finish(place(small_survey, Objective(count=1, scenarios=errors, risk="none")))
    plain = finish(place(small_survey, Objective(count=1)))
    np.testing.assert_array_equal(nominal.placement.chosen, plain.placement.chosen)
    assert len(nominal.placement.notes) > len(plain.placement.notes)


def steps_to_end(steps, acceptance, after):
    """Return the result of work that is accepted after some steps, and the number of steps that it takes then."""
    for _ in range(after):
        next(steps)
    acceptance.accept()
    rest = 0
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value, rest
        rest += 1


def test_acceptance_ends_what_follows_the_search(small_survey):
    errors = Scenarios(kind="pose-errors", pose_errors=PoseErrors(position=0.3), held_out=200)
    goal = Objective(count=2, scenarios=errors, risk="none")
    acceptance = Acceptance()
    began = len(list(place(small_survey, replace(goal, scenarios=Scenarios(), risk="auto"))))
    solution, rest = steps_to_end(place(small_survey, goal, acceptance=acceptance), acceptance, began + 5)
    assert rest == 0
    assert not any("in one of twenty cases" in note for note in solution.placement.notes)
    assert len(list(with_context(small_survey, solution))) > 3
    solution, rest = steps_to_end(with_context(small_survey, solution, acceptance), acceptance, 0)
    assert (solution.front, rest) == ((), 0)


@pytest.mark.parametrize("goal", [Objective(count=4, min_distance=3.0), Objective(coverage=0.7)])
def test_an_accepted_placement_has_one_note_on_the_end_of_its_search(small_survey, goal):
    acceptance = Acceptance()
    acceptance.accept()
    placement = finish(place(small_survey, goal, acceptance=acceptance)).placement
    assert placement.status == "feasible"
    assert [note for note in placement.notes if "search" in note] == [ACCEPTED_MESSAGE]


@pytest.mark.parametrize("criterion", ["road", "returns"])
def test_front_has_the_solution_at_its_own_number_and_more_sensors_are_never_worse(small_survey, criterion):
    solution = finish(place(small_survey, Objective(count=2, criterion=criterion)))
    found = finish(with_context(small_survey, solution))
    summary = found.deployment.returns
    points = found.front if summary is None else summary.front
    assert [point.count for point in points] == [1, 2, 3, 4]
    values = [point.coverage if summary is None else point.returns for point in points]
    assert values == sorted(values)
    own = solution.deployment.coverage if summary is None else np.expm1(solution.placement.objective)
    assert values[1] == pytest.approx(own)
    assert points[1].price == solution.placement.price
    assert (points[1].missed if summary is None else points[1].gap) == 0.0


def test_a_budget_certifies_no_more_sensors_than_it_pays(small_survey):
    dearest = max(model.price for model in small_survey.models.values())
    goal = Objective(count=3, criterion="road", budget=2 * dearest)
    two, three = (finish(place(small_survey, Objective(count=count, criterion="road"))) for count in (2, 3))
    found = finish(with_context(small_survey, finish(place(small_survey, goal))))
    assert [point.coverage for point in found.front[1:3]] == pytest.approx(
        [two.deployment.coverage, three.deployment.coverage]
    )


def test_placements_over_scenarios_have_no_front(small_survey):
    solution = finish(place(small_survey, Objective(count=2, failures="mean")))
    assert finish(with_context(small_survey, solution)).front == ()


def test_traffic_scenarios_need_runs(small_survey):
    with pytest.raises(SeipError, match="traffic"):
        finish(place(small_survey, Objective(count=1, scenarios=Scenarios(kind="traffic"))))


def test_a_sensor_moved_by_hand_sees_what_its_rays_see(small_survey):
    solution = finish(place(small_survey, Objective(count=1)))
    (one,) = solution.deployment.sensors
    mounted = one
    aside = replace(mounted, xyz=mounted.xyz + np.array([0.05, 0.0, 0.0]))
    moved = finish(evaluate_moved_sensors(small_survey, solution.objective, [aside], {aside.label: "here"}))
    (sensor,) = moved.deployment.sensors
    assert sensor.pose is None
    assert sensor.position_name == "here"
    assert moved.deployment.coverage == pytest.approx(solution.deployment.coverage, abs=0.1)
    below = replace(mounted, xyz=mounted.xyz * [1, 1, 0] - [0, 0, 1.0])
    with pytest.raises(SeipError, match="below the ground"):
        finish(evaluate_moved_sensors(small_survey, solution.objective, [below], {}))


def test_sensors_that_were_chosen_for_returns_are_evaluated_by_returns_when_moved(small_survey):
    solution = finish(place(small_survey, Objective(count=2, criterion="returns")))
    placed = solution.deployment
    same = finish(evaluate_moved_sensors(small_survey, solution.objective, placed.sensors, {}))
    assert same.deployment.returns.typical == pytest.approx(placed.returns.typical, rel=1e-5)
    assert same.deployment.returns.of_each == pytest.approx(placed.returns.of_each, rel=1e-5)
    assert same.deployment.returns.enough == placed.returns.enough
    assert 0 < min(placed.returns.enough.values()) <= max(placed.returns.enough.values()) <= 1
    assert same.deployment.pedestrian_returns == pytest.approx(placed.pedestrian_returns, rel=1e-5)
    assert same.placement.objective == pytest.approx(solution.placement.objective, rel=1e-5)
    one = finish(evaluate_moved_sensors(small_survey, solution.objective, placed.sensors[:1], {}))
    assert 0 < one.deployment.returns.typical < placed.returns.typical
    far = replace(placed.sensors[0], xyz=placed.sensors[0].xyz + np.array([0.0, 0.0, 500.0]))
    moved = finish(evaluate_moved_sensors(small_survey, solution.objective, [far, placed.sensors[1]], {}))
    second = finish(evaluate_moved_sensors(small_survey, solution.objective, placed.sensors[1:], {}))
    assert moved.deployment.returns.typical == pytest.approx(second.deployment.returns.typical, rel=1e-5)
    none = finish(evaluate_moved_sensors(small_survey, solution.objective, [], {}))
    assert none.deployment.returns.typical == 0.0
