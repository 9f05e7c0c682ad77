"""Simulated schedules of the surveys of a network on the workers of a cluster."""

from __future__ import annotations

import heapq

import numpy as np

from seip_addon.core.arrays import Float


def makespan(seconds: Float, workers: int, overhead: float) -> float:
    """Return the time until tasks are finished that workers take in their order as they become free.

    Parameters
    ----------
    seconds : (n,) float64
        Duration of each task.
    workers : int
    overhead : float, seconds
        Time that the scheduler adds to each task, during which it serves no other.
    """
    free = [0.0] * workers
    heapq.heapify(free)
    dispatched = end = 0.0
    for duration in seconds.tolist():
        # The scheduler dispatches one task at a time, and waits for the first worker that is free.
        dispatched = max(dispatched, free[0]) + overhead
        finished = dispatched + duration
        heapq.heapreplace(free, finished)
        end = max(end, finished)
    return end


def simulated_network(measured: Float, sites: int, workers: int, overhead: float, seed: int) -> float:
    """Return the makespan of a network whose sites are drawn with replacement from measured ones."""
    drawn = np.random.default_rng([seed, sites]).choice(measured, size=sites)
    return makespan(drawn, workers, overhead)
