"""A verification of the placement that `report_folder` makes, written without a recording."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from seip_addon.core.output.results.file_names import VERIFICATION_FILE, VERIFICATION_FOLDER, VERIFICATION_PICTURE
from seip_addon.core.output.results.placement_record import load_placement
from seip_addon.core.output.results.verification_record import (
    SCHEMA,
    RecordedChange,
    VerificationRecord,
)
from seip_addon.core.sensing.recordings.verification import (
    CoverageSteps,
    Gain,
    InstalledSensor,
    RecordedBackground,
)
from seip_addon.core.storage.files import save_json
from seip_addon.core.storage.json_dataclass import as_json

CHANGES = (
    RecordedChange("new", "Found 1", (10.0, -4.0, 2.0, 3.0, 1.5, 4.0, 0.5), 400, 0.0123),
    RecordedChange("gone", "Kiosk <b>", (-20.0, 9.0, 1.5, 4.0, 4.0, 3.0, 0.0), 300, -0.004),
    RecordedChange("new", "Found 3", (30.0, 9.0, 1.0, 1.0, 1.0, 2.0, 0.0), 30, 0.0001),
    RecordedChange("vehicle", "Found 2", (5.0, 0.0, 1.0, 4.5, 1.8, 1.6, 0.0), 200, None),
)
STEPS = CoverageSteps(0.62, 0.6, 0.605, 0.51, 0.7)


def make_pose(
    label: str,
    sensor: str,
    planned: tuple[float, ...],
    shift: tuple[float, float, float] = (0.3, -0.2, 0.0),
    rotation: tuple[float, float, float] = (0.0, -2.0, -1.5),
    gain: Gain | None = Gain(0.64, 0.49, 0.81),  # noqa: B008  # frozen
) -> InstalledSensor:
    """Return a sensor off its plan by a shift in metres and a rotation vector in degrees."""
    at = tuple(one + by for one, by in zip(planned, shift, strict=True))
    return InstalledSensor(
        id=label,
        sensor=sensor,
        local_m=at,
        orientation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        shift_m=shift,
        shift_half_width_m=(0.0011, 0.002, 0.0004),
        rotation_deg=rotation,
        rotation_half_width_deg=(0.011, 0.02, 0.004),
        match=0.9,
        background=RecordedBackground(30, 60.0, 0.05),
        gain=gain,
    )


def make_verification(folder: Path, without: int = 0) -> VerificationRecord:
    """Write a verification of all sensors of a placement, except the last ones, into its folder."""
    planned = load_placement(folder / "placement.json").sensors
    poses = tuple(make_pose(one.id, one.sensor, one.local_m) for one in planned[: len(planned) - without])
    record = VerificationRecord("site", "july <i>", poses, CHANGES, STEPS)
    own = folder / VERIFICATION_FOLDER
    own.mkdir()
    save_json(own / VERIFICATION_FILE, {"schema": SCHEMA, **as_json(record)})
    Image.new("RGB", (30, 20), (200, 30, 40)).save(own / VERIFICATION_PICTURE)
    return record
