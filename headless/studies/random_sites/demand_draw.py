"""Traffic of a training site: volumes, mix and signals drawn randomly for each run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from seip_addon.core.world.traffic_simulation.demand import (
    MAX_PARKED_LENGTH,
    MODELS,
    PARKED,
    VEHICLE_SHARES,
    Bay,
    Demand,
    Departure,
    rows_at_kerbs,
    type_line,
)
from seip_addon.core.world.traffic_simulation.simulation import SignalPlan
from seip_addon.core.world.traffic_simulation.street_network import StreetNetwork

from .street_plan import StreetPlan
from .varied_bodies import draw_size

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


@dataclass(frozen=True)
class DrawnDemand(Demand):
    """Demand with given parking at kerbs, in which each road user has its own size.

    Sizes are drawn as in `varied_bodies`, instead of taken from a model. Rows of parked cars at kerbs (`rows_at_kerbs`)
    are used if no street has parking lanes.

    Parameters
    ----------
    row_bays : int
        Number of bays in a row.
    occupied : float
        Share of the bays with a car.
    row_streets : float
        Share of the streets with room for a row that have one.
    first_bay : float, metres
        Distance from the start of the street to the first bay.
    """

    row_bays: int = 3
    occupied: float = 1.0
    row_streets: float = 0.5
    first_bay: float = 35.0

    def kerb_bays(self, network: StreetNetwork, seed: int, random: Random) -> Iterator[Bay]:
        """Yield the bays with parked cars at kerbs."""
        for bay in rows_at_kerbs(network, seed, self.row_streets, self.row_bays, self.first_bay):
            if self.occupied >= 1.0 or random.random() < self.occupied:
                yield bay

    def own_types(self, departures: Sequence[Departure], seed: int) -> dict[str, str]:
        """Return a type for each road user, with its own size; parked vehicles fit into their bays."""
        random = np.random.default_rng([seed, 3])
        known = {name: (category, model) for category, models in MODELS.items() for name, model in models.items()}
        types = {}
        for departure in departures:
            parked = departure.type.startswith(PARKED)
            category, model = known[departure.type.removeprefix(PARKED)]
            length, width, height = draw_size(category, random)
            while parked and length > MAX_PARKED_LENGTH:
                length, width, height = draw_size(category, random)
            own = model._replace(length=length, width=width, height=height)
            types[departure.name] = type_line(departure.name, own, parked=parked)
        return types


def draw_demand(plan: StreetPlan, random: Random) -> DrawnDemand:
    """Draw the demand of a run."""
    widest = max(arm.lanes_in for arm in plan.arms)
    logarithms = MIX_SPREAD * random.standard_normal(len(VEHICLE_SHARES))
    mix = {
        name: share * float(np.exp(step))
        for (name, share), step in zip(VEHICLE_SHARES.items(), logarithms, strict=True)
    }
    whole = sum(mix.values())
    least = {name: max(share / whole, LEAST_SHARES.get(name, 0.0)) for name, share in mix.items()}
    return DrawnDemand(
        flow=round(float(random.uniform(*FLOW[widest])), 0),
        turns=tuple(random.dirichlet([4.0, 10.0, 4.0]).round(3).tolist()),
        pedestrians=round(float(random.uniform(*PEDESTRIANS)), 0),
        shares={name: round(share / sum(least.values()), 4) for name, share in least.items()},
        row_bays=int(random.integers(*BAYS)),
        occupied=round(float(random.uniform(0.5, 1.0)), 2),
        row_streets=round(float(random.uniform(0.5, 1.0)), 2),
        first_bay=round(float(random.uniform(*FIRST_BAY)), 1),
    )


def draw_signals(random: Random) -> SignalPlan:
    """Draw the plan of the signals of a run."""
    return SignalPlan(green=int(random.integers(12, 32)))
