"""Files of a verification: pictures, record, table of changes, and catalogue of units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..base.distinct_names import distinct_names
from ..output.pictures.verification import save_changes_picture
from ..output.results.file_names import VERIFICATION_FILE, VERIFICATION_PICTURE
from ..output.results.verification_record import SCHEMA, RecordedChange, VerificationRecord
from ..sensing.recordings.verification import Verification
from ..sensing.scans.sensor import MountedSensor
from ..site.scene_geometry import SceneGeometry
from ..storage.csv_table import save_csv
from ..storage.files import save_json, whole_file
from ..storage.json_dataclass import as_json

UNITS_FILE = "units.toml"
"""Catalogue of the units of an installation."""
CHANGES_FILE = "changes.csv"
"""Table of what differs from the scene."""


def write_verification(
    folder: Path,
    geometry: SceneGeometry,
    planned: Sequence[MountedSensor],
    recording: str,
    found: Verification,
    versions: Mapping[str, str],
) -> None:
    """Write all files of a verification to a folder; the catalogue of units only if some gain is known.

    Parameters
    ----------
    recording : str
        Name of the recording.
    versions : mapping of str to str
        Versions of the program and its libraries.
    """
    save_changes_picture(folder / VERIFICATION_PICTURE, geometry, planned, found)
    save_changes(folder / CHANGES_FILE, found)
    save_units(folder / UNITS_FILE, recording, found)
    record = as_json(record_of(geometry.name, recording, found))
    save_json(folder / VERIFICATION_FILE, {"schema": SCHEMA, **record, "versions": dict(versions)})


def record_of(site: str, recording: str, found: Verification) -> VerificationRecord:
    """Return the record of a verification."""
    changes = [
        RecordedChange(
            change.kind,  # type: ignore[arg-type]  # of three kinds
            change.name,
            tuple(change.box.tolist()),
            change.rays,
            None if math.isnan(cost) else cost,
        )
        for change, cost in zip(found.changes, found.costs, strict=True)
    ]
    return VerificationRecord(site, recording, found.sensors, tuple(changes), found.coverage)


def save_units(path: Path, recording: str, found: Verification) -> None:
    """Write a catalogue with a model for each unit whose gain is known, if there is one."""
    pairs = zip(found.comparisons, found.sensors, strict=True)
    known = [(one.sensor, installed.gain) for one, installed in pairs if installed.gain is not None]
    keys = [re.sub(r"[^a-z0-9]", "_", f"{sensor.model.key}_{sensor.label}".lower()) for sensor, _ in known]
    tables = []
    for key, (sensor, gain) in zip(distinct_names(keys, "{}_{}"), known, strict=True):
        model, label = sensor.model, _plain(sensor.label)
        tables.append(
            f'[{key}]\nlike = "{model.key}"\nname = "{model.name}, unit {label}"\n'
            f"gain = {gain.value:.4g}  # 95 % interval: {gain.low:.3g} to {gain.high:.3g}\n"
            f'calibration = "recording {_plain(recording)}"\n'
        )
    if tables:
        with whole_file(path) as temporary:
            temporary.write_text("\n".join(tables), encoding="utf-8")


def save_changes(path: Path, found: Verification) -> None:
    """Write what differs from the scene as CSV, a row for each change."""
    sizes = ["x_m", "y_m", "z_m", "length_m", "width_m", "height_m"]
    rows = []
    for change, cost in zip(found.changes, found.costs, strict=True):
        *numbers, yaw = change.box.tolist()
        figures = [f"{value:.2f}" for value in (*numbers, math.degrees(yaw))]
        rows.append([change.kind, change.name, *figures, change.rays, "" if math.isnan(cost) else f"{cost:.5f}"])
    save_csv(path, ["kind", "name", *sizes, "yaw_deg", "rays", "coverage_cost"], rows)


def _plain(text: str) -> str:
    return "".join(letter for letter in text if letter.isprintable() and letter not in '"\\')
