"""Progress of the parts of the paper's detection study."""

from headless.studies.paper.detection import in_detail

from seip_addon.core.progress import Progress, finish


def counting(total, what):
    for done in range(total):
        yield Progress(done, total, what)
    return what


def test_work_in_detail_counts_what_is_done_within_its_unit():
    seen = []
    assert finish(in_detail(Progress(2, 5, "whole"), counting(4, "part")), seen.append) == "part"
    assert [(step.done, step.total, step.what) for step in seen] == [(8 + done, 20, "part") for done in range(4)]
