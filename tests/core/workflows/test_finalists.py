"""Finalists: different placements that all constraints allow, and the solution of their winner."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.judgement import MEAN, Figure, JudgedFinalist, Judgement
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.output.results.answer import answer, change_text
from seip_addon.core.output.results.placement_record import Provenance, parsed_record
from seip_addon.core.workflows.finalists import (
    MOVED_BY,
    JudgementRequest,
    check_judged,
    find_finalists,
    judged_solution,
    read_answer,
)
from seip_addon.core.workflows.placing import place, with_context
from seip_addon.core.workflows.records import record_of, restored_solution

MOST = 14
OBJECTIVES = {
    "count": Objective(count=2, criterion="returns"),
    "budget": Objective(budget=36_000.0, min_distance=20.0),
}


@pytest.fixture(scope="module", params=OBJECTIVES.values(), ids=OBJECTIVES)
def found(request, small_survey):
    """A solution with its finalists."""
    solution = finish(with_context(small_survey, finish(place(small_survey, request.param))))
    return solution, finish(find_finalists(small_survey, solution, MOST))


def problem_of(survey, solution):
    return placement_problem(survey.site, survey.grid.visible, survey.models, solution.objective)


def test_finalists_differ_and_meet_all_constraints(found, small_survey):
    solution, request = found
    finalists, problem = request.finalists, problem_of(small_survey, solution)
    assert set(finalists[0].poses) == set(solution.placement.chosen.tolist())
    assert len({frozenset(one.poses) for one in finalists}) == len(finalists) == MOST
    xyz = small_survey.site.candidates.xyz
    for one in finalists:
        chosen = np.array(one.poses)
        assert len(set(problem.positions[chosen].tolist())) == len(chosen) <= problem.most_sensors
        if problem.budget is not None:
            assert problem.prices[chosen].sum() <= problem.budget
        apart = np.hypot(*(xyz[chosen][:, None, :2] - xyz[chosen][None, :, :2]).T)
        assert (apart[~np.eye(len(chosen), dtype=bool)] >= problem.min_distance).all()


def test_a_near_placement_differs_by_one_pose_elsewhere_or_at_the_same_position(found, small_survey):
    solution, request = found
    problem = problem_of(small_survey, solution)
    bases = {one.name: one for one in request.finalists if ", but " not in one.name}
    assert any("alone" in name for name in bases)
    kinds = set()
    for one in request.finalists[len(bases) :]:
        base = bases[one.name.partition(", but ")[0]]
        (gone,), (new,) = np.setdiff1d(base.poses, one.poses), np.setdiff1d(one.poses, base.poses)
        far = np.hypot(*(problem.xyz[gone] - problem.xyz[new])[:2])
        assert far >= MOVED_BY or problem.positions[gone] == problem.positions[new]
        kinds.add(bool(far >= MOVED_BY))
    assert kinds == {True, False}


def test_a_request_is_read_as_it_was_written_and_has_the_sensors_of_its_poses(found, small_survey, tmp_path):
    _, request = found
    request.save(tmp_path / "finalists.json")
    read = read_answer(JudgementRequest, tmp_path / "finalists.json")
    assert read == request
    for one in read.finalists:
        deployed = small_survey.deploy(np.array(one.poses)).sensors
        for sensor, other in zip(one.sensors, deployed, strict=True):
            mounted = sensor.mounted(small_survey.models[sensor.sensor])
            assert (mounted.label, mounted.model) == (other.label, other.model)
            np.testing.assert_allclose(mounted.xyz, other.xyz, atol=1e-6)
            np.testing.assert_allclose(mounted.orientation, other.orientation, atol=1e-7)
    (tmp_path / "finalists.json").write_text("{}", encoding="utf-8")
    with pytest.raises(SeipError, match="damaged or missing"):
        read_answer(JudgementRequest, tmp_path / "finalists.json")


def figure(value):
    return {"vehicles": Figure(value, (value - 0.1, value + 0.1)), MEAN: Figure(value, (value - 0.1, value + 0.1))}


def judgement_of(request, order, leads):
    """Return a judgement with finalists in an order, of which those with a lead of the winner have final figures."""
    each = []
    for number in order:
        one = request.finalists[number]
        final = figure(0.8) if number in leads or number == order[0] else None
        each.append(JudgedFinalist(one.name, ("post",), one.poses, 64, figure(0.7), final, leads.get(number)))
    runs = tuple(f"run-{number}" for number in range(4))
    return Judgement(tuple(each), order.index(0), {"vehicles": 2.0, "pedestrians": 1.0}, runs, runs)


def test_the_winner_is_the_solution_and_its_record_keeps_the_judgement(found, small_survey):
    solution, request = found
    leads = {5: Figure(0.02, (-0.01, 0.05)), 0: Figure(0.05, (0.01, 0.09))}
    judgement = judgement_of(request, [3, 5, 1, 0], leads)
    winner = finish(judged_solution(small_survey, solution, judgement))
    names = [one.name for one in request.finalists]
    assert set(winner.placement.chosen.tolist()) == set(request.finalists[3].poses)
    assert winner.placement.objective <= solution.placement.objective
    assert winner.placement.bound == solution.placement.bound
    assert winner.front == solution.front
    record = record_of(small_survey, winner, Provenance(datetime.now(UTC), {}, {}))
    read = parsed_record(record.text())
    assert read == record
    assert finish(restored_solution(small_survey, read)).judgement == judgement
    said = " ".join(answer(read))
    for part in (
        f"among 4 finalists ({names[3]}): largest mean AP of vehicles, pedestrians weighted 2 : 1 in 64 frames",
        "AP in 4 other runs: vehicles 80.0% (70.0% to 90.0%), mean 80.0% (70.0% to 90.0%).",
        f"the runner-up, {names[5]}: +2.0 points [-1.0, +5.0], no difference beyond chance.",
        f"the best by the criterion, {names[0]}: +5.0 points [+1.0, +9.0].",
    ):
        assert part in said
    plain = record_of(small_survey, solution, Provenance(datetime.now(UTC), {}, {}))
    assert change_text(read, plain) == ""


def test_the_best_by_the_criterion_stays_the_solution_if_it_wins(found, small_survey):
    solution, request = found
    winner = finish(judged_solution(small_survey, solution, judgement_of(request, [0, 5], {5: Figure(0.05)})))
    assert winner.placement is solution.placement
    *_, runner_up, last = winner.judgement.sentences()
    assert runner_up.endswith("+5.0 points, from too few runs to tell it from chance.")
    assert last == "It is the best by the criterion, too."


def test_a_judgement_without_its_figures_is_refused(found):
    _, request = found
    judgement = judgement_of(request, [0, 5], {5: Figure(0.05)})
    winner, other = judgement.finalists
    for finalists, plain in (((), 0), ((other, winner), 2), ((replace(winner, final=None), other), 0)):
        with pytest.raises(ValueError, match="incomplete"):
            replace(judgement, finalists=finalists, plain=plain)


@pytest.mark.parametrize(
    ("objective", "message"),
    [
        (Objective(coverage=0.5), "a number of sensors or a budget"),
        (Objective(count=2, scenarios=Scenarios("traffic")), "leave out pose errors, traffic and failures"),
        (Objective(count=2, failures="worst"), "leave out pose errors, traffic and failures"),
    ],
)
def test_what_cannot_be_judged_is_refused(objective, message):
    with pytest.raises(SeipError, match=message):
        check_judged(objective)
