"""Traffic of a training site: volumes, mix and signals drawn randomly for each run."""

import numpy as np

from seip_addon.core.world.traffic_simulation.demand import VEHICLE_SHARES, Demand, KerbParking
from seip_addon.core.world.traffic_simulation.simulation import SignalPlan

from .street_plan import StreetPlan

Random = np.random.Generator

FLOW = {1: (300.0, 700.0), 2: (300.0, 950.0), 3: (400.0, 1100.0)}
"""Least and largest vehicles per hour that enter on each arm, by the number of lanes of the widest arm."""
MIX_SPREAD = 0.45  # standard deviation of the logarithm of each share of the mix, around the default share
LEAST_SHARES = {
    "truck": 0.10,
    "bus": 0.10,
    "motorcycle": 0.05,
    "bicycle": 0.08,
}  # of vehicles, before their sum is made 1
PEDESTRIANS = (60.0, 260.0)  # persons per hour and arm
BAYS = (3, 9)  # bays in a row at the kerb; the upper end is excluded
FIRST_BAY = (18.0, 40.0)  # metres from the junction


def draw_demand(plan: StreetPlan, random: Random) -> Demand:
    """Draw the demand of a run."""
    widest = max(arm.lanes_in for arm in plan.arms)
    logarithms = MIX_SPREAD * random.standard_normal(len(VEHICLE_SHARES))
    mix = {
        name: share * float(np.exp(step))
        for (name, share), step in zip(VEHICLE_SHARES.items(), logarithms, strict=True)
    }
    whole = sum(mix.values())
    least = {name: max(share / whole, LEAST_SHARES.get(name, 0.0)) for name, share in mix.items()}
    return Demand(
        flow=round(float(random.uniform(*FLOW[widest])), 0),
        turns=tuple(random.dirichlet([4.0, 10.0, 4.0]).round(3).tolist()),
        pedestrians=round(float(random.uniform(*PEDESTRIANS)), 0),
        shares={name: round(share / sum(least.values()), 4) for name, share in least.items()},
        own_sizes=True,
        kerb=KerbParking(
            bays=int(random.integers(*BAYS)),
            occupied=round(float(random.uniform(0.5, 1.0)), 2),
            streets=round(float(random.uniform(0.5, 1.0)), 2),
            first=round(float(random.uniform(*FIRST_BAY)), 1),
        ),
    )


def draw_signals(random: Random) -> SignalPlan:
    """Draw the plan of the signals of a run."""
    return SignalPlan(green=int(random.integers(12, 32)))
