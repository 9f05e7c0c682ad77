"""``placement.json``: a placement with all that it takes to read it, check it and make it again."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import platform
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Float
from ..errors import SeipError
from ..placement import Placement
from ..placement.deployment import Sensor
from ..placement.objective import Solution
from ..site.site import Site
from ..storage.files import save_json
from .headings import degrees, tilt_degrees

Record = dict[str, Any]

SCHEMA = "seip-placement/2"
LIBRARIES = ("numpy", "shapely", "pulp", "highspy")
MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"


@dataclass(frozen=True)
class Run:
    """What a placement was made with.

    Parameters
    ----------
    settings : mapping
        All that the user could have set, defaults included, by name; values that JSON can hold.
    created : datetime
        When, with its time zone.
    durations : mapping of str to float, seconds
        How long each step took.
    versions : mapping of str to str
        Of the program and what it stands on; see `versions`.
    inputs : mapping of str to str
        Digests or names of what went in.
    warnings : tuple of str
        What the user should know before trusting the figures.
    """

    settings: Mapping[str, object]
    created: datetime
    durations: Mapping[str, float]
    versions: Mapping[str, str]
    inputs: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def versions(**more: str) -> dict[str, str]:
    """Return the versions of this program, of Python and of the libraries that results stand on, and ``more``."""
    if MANIFEST.is_file():
        program = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]
    else:  # installed by pip
        program = metadata.version("seip")
    there = {name for name in LIBRARIES if importlib.util.find_spec(name)}  # HiGHS need not be
    libraries = {name: metadata.version(name) for name in LIBRARIES if name in there}
    return {"seip": program, "python": platform.python_version(), **libraries, **more}


def relevant_warnings(warnings: Iterable[str], considered: Iterable[str], chosen: Iterable[str]) -> list[str]:
    """Return the warnings but those of sensor types that were considered and not chosen; types are catalogue keys."""
    others = set(considered) - set(chosen)
    return [warning for warning in warnings if warning.partition(":")[0] not in others]


@lru_cache(maxsize=8)
def parsed_record(text: str) -> Record:
    """Return the record of a JSON text; panels ask for it at every redraw."""
    record: Record = json.loads(text)
    return record


def placement_record(site: Site, plan: Solution, run: Run) -> Record:
    """Return a placement as the value that ``placement.json`` holds.

    Parameters
    ----------
    plan : Solution
        Of that site.
    run : Run
        What it was made with.

    Returns
    -------
    dict
        Its layout is described in docs/formats.md and docs/placement.schema.json.
    """
    deployment, placement, greedy = plan.deployment, plan.placement, plan.greedy
    return {
        "schema": SCHEMA,
        "site": {"name": site.name, "origin_m": _metres(site.origin)},
        "sensors": [_sensor(sensor, site.origin) for sensor in deployment.sensors],
        "price_usd": _rounded(deployment.price, 2),
        "coverage": {
            "whole": _share(deployment.coverage),
            "central": None if deployment.central is None else _share(deployment.central),
            "weighted": _share(deployment.weighted),
            "seen_twice": _share(deployment.seen_twice),
        },
        "objective": {
            "kind": "weighted" if plan.objective.weighted else "vanilla",
            "sought": "least price" if plan.objective.cheapest else "most coverage",
            "value": _significant(placement.objective),
            "bound": _significant(placement.bound),
            "gap": _significant(placement.gap),
            "status": placement.status,
            "solver": placement.solver,
        },
        "greedy": None if greedy is None else _greedy(greedy, placement),
        "counts": _counts(site),
        "settings": dict(run.settings),
        "seeds": {},  # visibility and placement draw no random numbers
        "inputs": dict(run.inputs),
        "notes": list(placement.notes),
        "warnings": list(run.warnings),
        "versions": dict(run.versions),
        "times": {
            "created": run.created.isoformat(timespec="seconds"),
            "durations_s": {step: _rounded(seconds, 3) for step, seconds in run.durations.items()},
        },
    }


def comparable(record: Record) -> Record:
    """Return the record without what differs from one machine and run to the next: times and versions."""
    return {key: value for key, value in record.items() if key not in ("times", "versions")}


def save_placement_record(path: str | os.PathLike[str], record: Record) -> None:
    """Write ``placement.json``."""
    save_json(path, record)


def load_placement_record(path: str | os.PathLike[str]) -> Record:
    """Read ``placement.json``.

    Raises
    ------
    SeipError
        There is no such file, or it is no placement of a version that this program knows.
    """
    try:
        record: Record = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror}; name the placement.json of a finished run") from error
    except (ValueError, RecursionError) as error:
        raise SeipError(f"{path} is damaged or no JSON: {error}; place the sensors again") from error
    schema = record.get("schema") if isinstance(record, dict) else None
    if schema != SCHEMA:
        raise SeipError(f"{path} has the schema {schema!r}, not {SCHEMA!r}; place the sensors again with this version")
    return record


def _sensor(sensor: Sensor, origin: Float) -> Record:
    return {
        "id": sensor.label,
        "pose": sensor.pose,
        "sensor": sensor.model.key,
        "sensor_name": sensor.model.name,
        "position": sensor.position_name,
        "on_pole": sensor.on_pole,
        "local_m": _metres(sensor.xyz),
        "map_m": _metres(sensor.xyz + origin),
        "height_m": _rounded(sensor.height, 6),
        "yaw_deg": degrees(sensor.yaw),
        "tilt_deg": tilt_degrees(sensor.tilt),
        "price_usd": _rounded(sensor.model.price, 2),
        "coverage_alone": _share(sensor.alone),
        "coverage_added": _share(sensor.added),
        "coverage_marginal": _share(sensor.marginal),
        **({"roll_deg": tilt_degrees(sensor.roll)} if sensor.pose is None else {}),
    }


def _greedy(greedy: Placement, placement: Placement) -> Record:
    lost = placement.objective - greedy.objective
    return {
        "value": _significant(greedy.objective),
        # The better of the two bounds: once the optimum is proven, it no longer hangs on a platform's rounding.
        "bound": _significant(min(greedy.bound, placement.bound)),
        "gap_to_placement": _share(lost / placement.objective) if placement.objective > 0.0 else 0.0,
        "poses": [int(pose) for pose in greedy.chosen],
        "notes": list(greedy.notes),
    }


def _counts(site: Site) -> Record:
    candidates = site.candidates
    return {
        "targets": len(site.targets),
        "targets_central": int(np.count_nonzero(site.targets.central)),
        "positions": len(candidates.position),
        "positions_on_poles": int(np.count_nonzero(candidates.on_pole)),
        "poses": len(candidates),
        "dropped": {reason: int(count) for reason, count in sorted(candidates.dropped.items())},
    }


def _metres(point: Float) -> list[float]:
    """Round to the micrometre, which hides the last bits in which platforms differ."""
    return [_rounded(value, 6) for value in point]


def _share(value: float) -> float:
    return _rounded(value, 9)


def _rounded(value: float, digits: int) -> float:
    return round(float(value), digits) + 0.0  # no negative zero


def _significant(value: float) -> float | None:
    """Return twelve significant digits; None for a bound that the solver has not found."""
    return float(f"{value:.12g}") if math.isfinite(value) else None
