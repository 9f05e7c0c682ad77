"""Streets and crossings of an extract in plan, for a map on which a user chooses a crossing."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from ...geometry.tangent_plane import plan_metres
from ..street_plan import PlanStreet, StreetPlan, name_places
from .crossings import Crossing
from .extract import Extract
from .streets import importance, is_street


def street_plan(extract: Extract, crossings: Sequence[Crossing]) -> StreetPlan:
    """Return the streets of an extract in plan, with the given crossings in their order.

    Within 10 km of the middle, distances are right to 0.2 %.
    """
    streets = [way for way in extract.ways.values() if is_street(way.tags)]
    degrees = [
        np.array([(node.latitude, node.longitude) for node in extract.line(way)], dtype=np.float64).reshape(-1, 2)
        for way in streets
    ]
    at = np.array([(one.latitude, one.longitude) for one in crossings], dtype=np.float64).reshape(-1, 2)
    everything = np.concatenate([at, *degrees])
    bounds = at if len(at) else everything
    middle = (bounds.min(axis=0) + bounds.max(axis=0)) / 2.0 if len(bounds) else np.zeros(2)
    drawn, named = [], defaultdict(list)
    for way, line in zip(streets, degrees, strict=True):
        if len(line) < 2:
            continue  # the extract has at most one of its nodes
        street = PlanStreet(plan_metres(line, middle), importance(way.tags))
        drawn.append(street)
        if "name" in way.tags:
            named[way.tags["name"]].append(street)
    return StreetPlan(
        tuple(drawn),
        plan_metres(at, middle),
        np.array([one.importance for one in crossings], dtype=np.int64),
        name_places(named),
        extract.attribution,
    )
