"""Table of a coverage study: every cell as CSV."""

import os

from seip_addon.core.geometry.orientation import tilt_degrees
from seip_addon.core.storage.csv_table import save_csv

from .cells import Case, CoverageStudy, EmptyCell

COLUMNS = (
    "sensor", "height_m", "count", "central_weight", "sensors_used", "heights_used_m", "tilts_used_deg",
    "coverage", "central_coverage", "seen_twice", "objective", "bound", "gap", "status", "greedy_objective",
    "price_usd", "note",
)  # fmt: skip


def save_study_table(path: str | os.PathLike[str], study: CoverageStudy) -> None:
    """Write one row for each cell as CSV; for cells without a placement, the column ``note`` has the reason."""
    rows = [_key(cell) | (_figures(cell) if isinstance(cell, Case) else {"note": cell.note}) for cell in study.cells]
    save_csv(path, COLUMNS, [[row.get(column, "") for column in COLUMNS] for row in rows])


def _key(cell: Case | EmptyCell) -> dict[str, str]:
    return {
        "sensor": cell.sensor,
        "height_m": "free" if cell.height is None else f"{cell.height:g}",
        "count": f"{cell.count}",
        "central_weight": f"{cell.weight:g}",
    }


def _figures(case: Case) -> dict[str, str]:
    placement, deployment = case.placement, case.deployment
    return {
        "sensors_used": f"{len(deployment.sensors)}",
        "heights_used_m": " ".join(f"{sensor.height:g}" for sensor in deployment.sensors),
        "tilts_used_deg": " ".join(f"{tilt_degrees(sensor.tilt):g}" for sensor in deployment.sensors),
        "coverage": f"{deployment.coverage:.6f}",
        "central_coverage": "" if deployment.central is None else f"{deployment.central:.6f}",
        "seen_twice": f"{deployment.seen_twice:.6f}",
        "objective": f"{placement.objective:.12g}",
        "bound": f"{placement.bound:.12g}",
        "gap": f"{placement.gap:.6g}",
        "status": placement.status,
        "greedy_objective": f"{case.greedy.objective:.12g}",
        "price_usd": f"{deployment.price:.2f}",
        "note": "; ".join(placement.notes),
    }
