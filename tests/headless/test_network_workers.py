"""Workers of a network: one that is killed, and a scheduler that stops, in processes of their own."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("distributed", reason="Dask is not installed: make environment")

from headless.network_workers import connected, run_jobs

from seip_addon.core.base.errors import SeipError

pytestmark = pytest.mark.slow


def started(folder, name, *options):
    command = [sys.executable, "-m", f"distributed.cli.dask_{name}", "--scheduler-file", str(folder / "scheduler.json")]
    with (folder / f"{name}.log").open("a") as log:
        return subprocess.Popen([*command, "--no-dashboard", *options], stdout=log, stderr=log)  # noqa: S603  # Dask's own


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, its process, and those of two workers without a nanny, which nobody starts again."""
    scheduler = started(tmp_path, "scheduler", "--host", "127.0.0.1", "--port", "0")
    crew = [started(tmp_path, "worker", "--nthreads", "1", "--no-nanny") for _ in range(2)]
    path = tmp_path / "scheduler.json"
    for _ in range(300):
        if path.exists() and path.stat().st_size:
            break
        time.sleep(0.1)
    address = json.loads(path.read_text(encoding="utf-8"))["address"]
    yield address, scheduler, crew
    for process in (*crew, scheduler):
        process.kill()
        process.wait()


def crew_of(address):
    """Wait until both workers have come, and return a context with them."""
    for _ in range(60):
        try:
            with connected(address, 2) as there:
                if len(there.nthreads()) == 2:
                    return connected(address, 2)
        except SeipError:
            pass
        time.sleep(0.5)
    raise AssertionError("the workers did not come")


def test_jobs_of_a_killed_worker_are_done_by_another(cluster):
    address, _, crew = cluster
    with crew_of(address) as there:
        results = run_jobs(there, time.sleep, [(0.5,)] * 12)
        done = [next(results)[0] for _ in range(2)]
        crew[0].send_signal(signal.SIGKILL)
        done += [number for number, _, reason in results if not reason]
    assert sorted(done) == list(range(12))


def test_a_scheduler_that_stops_is_one_sentence(cluster, caplog, capfd):
    address, scheduler, _ = cluster
    with crew_of(address) as there:
        results = run_jobs(there, time.sleep, [(1.0,)] * 30)
        next(results)
        scheduler.send_signal(signal.SIGKILL)
        time.sleep(3.0)  # Dask tries to connect again meanwhile
        with pytest.raises(SeipError, match="the Dask scheduler stopped: start it again"):
            list(results)
    assert not [record for record in caplog.records if record.name == "distributed.client"]
    assert "Traceback" not in capfd.readouterr().err


def test_a_job_that_ends_its_workers_is_a_failure_and_others_go_on():
    with connected(None, 1) as there:
        ended, whole = (
            next(run_jobs(there, function, [(number,)])) for number, function in ((1, os._exit), (0, time.sleep))
        )
    assert ended == (0, None, "several workers ended in the midst of it, as when memory runs out: shorten --approaches")
    assert whole == (0, None, "")
