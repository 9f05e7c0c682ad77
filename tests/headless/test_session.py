import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from typing import Never

from headless import session

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, finish

ROOT = Path(__file__).resolve().parents[2]


def test_plain_python_passes_on_all_but_the_program_name() -> None:
    assert session.arguments(["place.py", "site.blend", "--count", "4"]) == ["site.blend", "--count", "4"]


@pytest.mark.parametrize(
    ("argv", "own"),
    [
        (["blender", "-b", "site.blend", "-P", "place.py", "--", "--count", "4"], ["--count", "4"]),
        (["blender", "-b", "-P", "place.py"], []),
        (["blender", "-P", "x.py", "--", "a", "--", "b"], ["a", "--", "b"]),
    ],
)
def test_blender_passes_on_what_follows_the_two_dashes(argv, own, monkeypatch) -> None:
    monkeypatch.setattr(session, "in_blender", lambda: True)
    assert session.arguments(argv) == own


def test_a_mistake_is_one_line_and_status_1(capsys) -> None:
    def main(_argv) -> Never:
        raise SeipError("there is no lane here; move the point")

    with pytest.raises(SystemExit) as end:
        session.run(main)
    assert end.value.code == 1
    assert capsys.readouterr().err == "error: there is no lane here; move the point\n"


def test_success_is_status_0() -> None:
    with pytest.raises(SystemExit) as end:
        session.run(lambda _argv: None)
    assert end.value.code == 0


def test_a_defect_keeps_its_traceback() -> None:
    with pytest.raises(ZeroDivisionError):
        session.run(lambda _argv: 1 / 0)


def test_control_c_ends_with_130_and_one_line() -> None:
    script = (
        "import time\nfrom headless import session\n"
        "def main(argv):\n    print('ready', flush=True)\n    time.sleep(60)\nsession.run(main)\n"
    )
    with subprocess.Popen(  # noqa: S603  # our own interpreter and script
        [sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert "ready\n" in iter(process.stdout.readline, "")  # Blender 5.2 writes a line of its own before
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=60)
    assert process.returncode == 130
    assert complaint == "stopped, no result written\n"


def test_progress_reaches_the_total_and_restarts(capsys) -> None:
    def work():
        for total in (3, 5):
            for done in range(total + 1):
                yield Progress(done, total, f"part of {total}")

    with session.progress_bar() as report:
        finish(work(), report)
    shown = capsys.readouterr().err
    assert "part of 3: 100%" in shown
    assert "part of 5: 100%" in shown
