"""Progress: the line that users see, and how often it changes."""

import pytest

from seip_addon.core.base import progress
from seip_addon.core.base.progress import Progress, finish, progress_line, reporter, time_text, within


@pytest.mark.parametrize(
    ("known", "times", "line"),
    [
        (Progress(0, 0, "laying out the site"), (2.0,), "laying out the site: 2 s elapsed"),
        (Progress(168, 672, "visibility"), (6.0, 18.0), "visibility: 25% done, 18 s left"),
        (Progress(1, 4, "writing tables", counted=False), (240.0,), "writing tables: 25% done, 4 min elapsed"),
        (Progress(0, 0, "first choice", best="20 points on a pedestrian"), (3.0,),
         "first choice: 20 points on a pedestrian, 3 s elapsed"),
        (Progress(0, 0, "improving the placement", best="71% of the road", gap=0.052), (8.0,),
         "improving the placement: 71% of the road, gap at most 5.2%, 8 s elapsed"),
        (Progress(0, 0, "proving", best="71% of the road", gap=0.0), (61.0,),
         "proving: 71% of the road, gap at most 0.0%, 61 s elapsed"),
    ],
)  # fmt: skip
def test_line_names_phase_value_gap_and_time(known, times, line):
    assert progress_line(known, time_text(*times)) == line


def search(values):
    for value in values:
        yield Progress(0, 0, "swapping sensors", best=f"{value}%", gap=0.5)
    return values[-1]


def test_whole_shows_the_value_and_gap_of_its_part():
    whole = Progress(1, 3, "placing for the worst quarter", counted=False)
    shown = []
    assert finish(within(whole, search([70, 71])), shown.append) == 71
    assert [progress_line(one) for one in shown] == [
        f"placing for the worst quarter: 33% done, {value}%, gap at most 50.0%" for value in (70, 71)
    ]


def test_line_changes_at_once_for_a_better_value_and_otherwise_at_intervals(monkeypatch):
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    shown = []
    report = reporter(lambda one, time: shown.append((now, one.best, time)), 1.0)
    for step in range(40):
        now = step / 10
        report(Progress(0, 0, "swapping sensors", best="" if step < 5 else "70%" if step < 17 else "71%"))
    assert shown == [
        (0.5, "70%", "1 s elapsed"),
        (1.5, "70%", "2 s elapsed"),
        (1.7, "71%", "2 s elapsed"),
        (2.7, "71%", "3 s elapsed"),
        (3.7, "71%", "4 s elapsed"),
    ]


def test_work_is_closed_where_its_report_raises():
    closed = []

    def work():
        try:
            yield Progress(0, 0, "rendering")
        finally:
            closed.append(True)

    def interrupted(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        finish(work(), interrupted)
    assert closed == [True]
