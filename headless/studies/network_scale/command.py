"""Processor time and memory of the sites of a network, and simulated schedules of larger networks.

seip study network-scale --random 100 -o out/random
seip network out/random/sites.csv --budget 2_000_000 -o city/
seip study network-scale city/ -o out/scale
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from headless import runtime
from headless.network_tasks import USAGE, run_jobs
from headless.options import new_parser, whole_number
from headless.studies.network_scale.random_network import TABLE, write_random_network
from headless.studies.network_scale.schedule import simulated_network

import numpy as np

from seip_addon.core.dask_client import connected
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import SEED, Limits
from seip_addon.core.storage.files import save_json
from seip_addon.core.workflows.network_sites import MOST_SITES

SIMULATED = ((1_000, 2), (1_000, 32), (10_000, 2), (10_000, 32), (10_000, 256))
"""Numbers of sites and workers whose schedules are simulated."""
EMPTY_TASKS = 200
"""Tasks without work by which the overhead of the scheduler is measured."""


def main(argv: list[str]) -> None:
    """Write a random network, or summarise the surveys of networks, measure the scheduler, and simulate more sites."""
    options = _parser().parse_args(argv)
    if bool(options.folders) == (options.random is not None):
        raise SeipError("name result folders of `seip network`, or give --random N for a table of random junctions")
    runtime.check_folder(options.output)
    if options.random is not None:
        options.output.mkdir(parents=True, exist_ok=True)
        runtime.finish_with_bar(write_random_network(options.output, options.random, options.seed))
        runtime.print_line(f"written {options.output / TABLE}")
        return
    paths = [path for one in options.folders for path in sorted(one.glob(f"*/{USAGE}"))]
    usage = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    if not usage:
        raise SeipError("the folders hold no surveyed site: name result folders of `seip network`")
    seconds, memory = (np.array([one[name] for one in usage]) for name in ("processor_s", "peak_memory_mb"))
    overhead = _overhead(options.workers)
    low, middle, high = np.quantile(seconds, (0.05, 0.5, 0.95)).tolist()
    simulated = {
        (sites, many): simulated_network(seconds, sites, many, overhead, options.seed) / 3600.0
        for sites, many in SIMULATED
    }
    figures = {
        "sites": len(usage),
        "processor_s": {"median": middle, "low": low, "high": high, "mean": float(seconds.mean())},
        "peak_memory_mb": {"median": float(np.median(memory)), "largest": float(memory.max())},
        "overhead_s_per_task": overhead,
        "simulated_hours": {f"{sites} sites, {many} workers": hours for (sites, many), hours in simulated.items()},
    }
    save_json(options.output / "scale.json", figures)
    runtime.print_line(
        f"{len(usage)} sites: {middle:.0f} processor seconds each (5 to 95 %: {low:.0f} to {high:.0f}), peak memory "
        f"{memory.max():.0f} MB; the scheduler adds {1000 * overhead:.1f} ms to a task, "
        f"{overhead / float(seconds.mean()):.2%} of its time"
    )
    for (sites, many), hours in simulated.items():
        runtime.print_line(f"simulated, not measured: {sites:,} sites on {many} workers: {hours:.1f} h")


def _overhead(number: int) -> float:
    """Return the wall-clock seconds that a task without work takes on a cluster of this machine."""
    with connected(None, number) as client:
        jobs = [lambda: None] * EMPTY_TASKS
        list(run_jobs(client, bool, jobs))  # starts the workers, which cannot import bpy: hence a built-in function
        began = time.perf_counter()
        list(run_jobs(client, bool, jobs))
        return (time.perf_counter() - began) / EMPTY_TASKS


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study network-scale", "Measure the sites of networks, and simulate larger networks.")
    parser.add_argument("folders", nargs="*", type=Path, help="result folders of `seip network`")
    parser.add_argument(
        "--random", type=whole_number(Limits(1, MOST_SITES)), metavar="N", help="write a table of N random junctions"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--workers", type=whole_number(Limits(1, 256)), default=2, metavar="N", help="workers")
    parser.add_argument(
        "--seed", type=whole_number(SEED), default=1, help="seed of the random junctions and of the simulated networks"
    )
    return parser
