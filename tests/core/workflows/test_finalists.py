"""Finalists: different placements that all constraints allow, and the solution of their winner."""

from datetime import UTC, datetime

import numpy as np
import pytest

from seip_addon.core.choosing.placement.judgement import MEAN, Figure, FinalFigures, JudgedFinalist, Judgement
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.answer import answer, change_text
from seip_addon.core.output.results.placement_file import parsed_record
from seip_addon.core.output.results.placement_record import Provenance
from seip_addon.core.progress import finish
from seip_addon.core.workflows.finalists import MOVED_BY, find_finalists, judged_solution, require_judged
from seip_addon.core.workflows.judging import judgement_request, read_request
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


def test_finalists_differ_and_meet_all_constraints(found, small_survey):
    solution, finalists = found
    np.testing.assert_array_equal(finalists[0].chosen, solution.placement.chosen)
    assert len({frozenset(one.chosen.tolist()) for one in finalists}) == len(finalists) == MOST
    xyz = small_survey.site.candidates.xyz
    for one in finalists:
        problem, chosen = one.problem, one.chosen
        assert len(set(problem.positions[chosen].tolist())) == len(chosen) <= problem.most_sensors
        if problem.budget is not None:
            assert problem.prices[chosen].sum() <= problem.budget
        apart = np.hypot(*(xyz[chosen][:, None, :2] - xyz[chosen][None, :, :2]).T)
        assert (apart[~np.eye(len(chosen), dtype=bool)] >= problem.min_distance).all()


def test_a_near_placement_differs_by_one_pose_elsewhere_or_at_the_same_position(found, small_survey):
    _, finalists = found
    bases = {one.name: one for one in finalists if ", but " not in one.name}
    near = [one for one in finalists if ", but " in one.name]
    kinds = set()
    for one in near:
        base = next(base for name, base in bases.items() if one.name.startswith(f"{name}, but "))
        (gone,), (new,) = np.setdiff1d(base.chosen, one.chosen), np.setdiff1d(one.chosen, base.chosen)
        far = np.hypot(*(one.problem.xyz[gone] - one.problem.xyz[new])[:2])
        assert far >= MOVED_BY or one.problem.positions[gone] == one.problem.positions[new]
        kinds.add(far >= MOVED_BY)
    assert kinds == {True, False}
    assert any("alone" in name for name in bases)


def test_the_request_of_a_judgement_is_read_as_it_was_written(found, small_survey, tmp_path):
    solution, finalists = found
    request = judgement_request(small_survey, solution.objective.shares, finalists)
    request.save(tmp_path / "finalists.json")
    read = read_request(tmp_path / "finalists.json")
    assert read == request
    for one, finalist in zip(read.finalists, finalists, strict=True):
        mounted = one.mounted(small_survey.models)
        deployed = small_survey.deploy(finalist.chosen).sensors
        for sensor, other in zip(mounted, deployed, strict=True):
            assert (sensor.label, sensor.model) == (other.label, other.model)
            np.testing.assert_array_equal(sensor.xyz, other.xyz)
            np.testing.assert_array_equal(sensor.orientation, other.orientation)


def judgement_of(finalists, figures):
    each = tuple(
        JudgedFinalist(one.name, ("post at 4 m",), tuple(one.chosen.tolist()), 64, {MEAN: Figure(0.7)})
        for one in finalists
    )
    runs = tuple(f"run-{number}" for number in range(4))
    return Judgement(each, {"vehicles": 2.0, "pedestrians": 1.0}, runs, runs, figures)


def figure(value):
    return {"vehicles": Figure(value, (value - 0.1, value + 0.1)), MEAN: Figure(value, (value - 0.1, value + 0.1))}


def test_the_winner_is_the_solution_and_its_record_keeps_the_judgement(found, small_survey):
    solution, finalists = found
    lead, chance = Figure(0.05, (0.01, 0.09)), Figure(0.02, (-0.01, 0.05))
    figures = (FinalFigures(3, figure(0.8)), FinalFigures(5, figure(0.75), chance), FinalFigures(0, figure(0.7), lead))
    judgement = judgement_of(finalists, figures)
    winner = finish(judged_solution(small_survey, solution, judgement))
    np.testing.assert_array_equal(np.sort(winner.placement.chosen), np.sort(finalists[3].chosen))
    assert winner.placement.objective <= solution.placement.objective
    assert winner.placement.bound == solution.placement.bound
    assert winner.front == solution.front
    record = record_of(small_survey, winner, Provenance(datetime.now(UTC), {}, {}))
    read = parsed_record(record.text())
    assert read == record
    assert finish(restored_solution(small_survey, read)).judgement == judgement
    said = " ".join(answer(read))
    for part in (
        f"among {MOST} finalists ({finalists[3].name}): largest mean AP of vehicles, pedestrians weighted 2 : 1",
        "in 64 frames of 4 runs.",
        "AP in 4 other runs: vehicles 80.0% (70.0% to 90.0%); mean 80.0% (70.0% to 90.0%).",
        f"the runner-up, {finalists[5].name}: +2.0 points [-1.0, +5.0], no difference beyond chance.",
        f"the best by the criterion, {finalists[0].name}: +5.0 points [+1.0, +9.0].",
    ):
        assert part in said
    plain = record_of(small_survey, solution, Provenance(datetime.now(UTC), {}, {}))
    assert change_text(read, plain) == ""


def test_the_best_by_the_criterion_stays_the_solution_if_it_wins(found, small_survey):
    solution, finalists = found
    figures = (FinalFigures(0, figure(0.8)), FinalFigures(5, figure(0.75), Figure(0.05)))
    winner = finish(judged_solution(small_survey, solution, judgement_of(finalists, figures)))
    assert winner.placement is solution.placement
    *_, runner_up, last = winner.judgement.sentences()
    assert runner_up.endswith("+5.0 points, from too few runs to tell it from chance.")
    assert last == f"It is the best by the criterion, {finalists[0].name}, too."


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
        require_judged(objective)
