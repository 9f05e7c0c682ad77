import os
import re
import subprocess
import sys
import termios
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from typing import Never

from headless import runtime

from seip_addon.core.base import progress
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("argv", "own"),
    [
        (["blender", "-b", "site.blend", "-P", "place.py", "--", "--count", "4"], ["--count", "4"]),
        (["blender", "-P", "x.py", "--", "a", "--", "b"], ["a", "--", "b"]),
    ],
)
def test_blender_passes_on_what_follows_the_two_dashes(argv, own, monkeypatch) -> None:
    monkeypatch.setattr(runtime, "in_blender", lambda: True)
    assert runtime.arguments(argv) == own


def test_a_mistake_is_one_line_and_status_1(capsys) -> None:
    def main(_argv) -> Never:
        raise SeipError("there is no lane here; move the point")

    with pytest.raises(SystemExit) as end:
        runtime.run(main)
    assert end.value.code == 1
    assert capsys.readouterr().err == "error: there is no lane here; move the point\n"


def test_a_pipe_is_refused_before_a_reader_waits_for_it(tmp_path, capsys) -> None:
    pipe = tmp_path / "map.osm"
    os.mkfifo(pipe)
    for words in (["place", str(pipe)], [f"--traffic={pipe}"]):
        with pytest.raises(SeipError, match=r"map\.osm is neither a file nor a folder: write .* to a file"):
            runtime.refuse_pipes(words)
    plain = [str(tmp_path), "no such file", "x" * 5000, "\0", os.devnull, "--count=3"]
    assert runtime.refuse_pipes(plain) == plain


def test_a_log_gets_a_line_every_ten_seconds_and_at_each_better_placement(capsys, monkeypatch) -> None:
    clock = iter(range(0, 100, 4))
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with runtime.progress_bar() as report:
        for done in range(8):
            report(Progress(done, 8, "visibility"))
        for best in ("70% of the road", "70% of the road", "71% of the road", "71% of the road", ""):
            report(Progress(0, 0, "improving the placement", best=best, gap=0.052))
    assert capsys.readouterr().err.splitlines() == [
        "visibility: 25% done, 24 s left",
        "visibility: 62% done, 12 s left",
        "improving the placement: 70% of the road, gap at most 5.2%, 36 s elapsed",
        "improving the placement: 71% of the road, gap at most 5.2%, 44 s elapsed",
    ]


def test_a_narrow_terminal_cuts_the_phase_and_keeps_value_and_time() -> None:
    script = (
        "from headless import runtime\nfrom seip_addon.core.base.progress import Progress\n"
        "with runtime.progress_bar() as report:\n"
        "    report(Progress(0, 0, 'improving the placement', best='71% of the road', gap=0.052))\n"
    )
    ours, theirs = os.openpty()
    termios.tcsetwinsize(theirs, (24, 60))
    subprocess.run([sys.executable, "-c", script], cwd=ROOT, stderr=theirs, check=True)  # noqa: S603  # our own
    os.close(theirs)
    shown = os.read(ours, 4096).decode()
    os.close(ours)
    lines = [line for line in re.split(r"[\r\n]+", shown) if line.strip()]
    assert lines == ["improving …: 71% of the road, gap at most 5.2%, 1 s elapsed"]


def test_what_is_logged_goes_to_the_output_and_warnings_say_so(capsys) -> None:
    runtime.LOG.info("read")
    runtime.warn(["the road is bare"])
    assert capsys.readouterr().out == "read\nwarning: the road is bare\n"
