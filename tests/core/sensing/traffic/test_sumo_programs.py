"""Programs of SUMO that are stopped while they run."""

import sys
import time
from pathlib import Path

import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sumo_programs import Sumo, run

PYTHON = Path(sys.executable)
PROGRAMS = Sumo(PYTHON, PYTHON, None)


@pytest.mark.slow
def test_a_program_ends_with_the_run_that_started_it(tmp_path):
    mark = tmp_path / "mark"
    script = f"import pathlib, time\nmark = pathlib.Path({str(mark)!r})\nmark.touch()\ntime.sleep(2)\nmark.unlink()"
    steps = run(PROGRAMS, PYTHON, ["-c", script], "waiting")
    while not mark.exists():
        next(steps)
    steps.close()
    time.sleep(2.5)
    assert mark.exists()


def test_a_program_that_fails_is_named_with_its_reason():
    script = "import sys; sys.exit('Error: Nothing to do.')"
    with pytest.raises(SeipError, match="failed: Nothing to do; check the map"):
        finish(run(PROGRAMS, PYTHON, ["-c", script], "waiting"))
