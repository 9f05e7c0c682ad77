"""Coverage of sensor types × heights × numbers on any scene, vanilla against weighted.

seip study coverage scenes/junction.blend -o out/study
blender -b --python-exit-code 1 site.blend -P headless/study.py -- coverage -o out/study
"""

import os

from headless import runtime, survey
from headless.studies.claims import save_claims
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, Case, CoverageStudy, EmptyCell, coverage_study
from headless.studies.coverage.charts import save_height_chart, save_weight_chart
from headless.studies.coverage.claims import coverage_claims
from headless.studies.survey_options import study_parser

from seip_addon.core.choosing.placement.objective import Objective, check_objective
from seip_addon.core.geometry.orientation import tilt_degrees
from seip_addon.core.output.pictures.drawing import save_png
from seip_addon.core.output.pictures.plan_view import draw_plan
from seip_addon.core.storage.csv_table import save_csv

COLUMNS = (
    "sensor", "height_m", "count", "central_weight", "sensors_used", "heights_used_m", "tilts_used_deg",
    "coverage", "central_coverage", "seen_twice", "objective", "bound", "gap", "status", "greedy_objective",
    "price_usd", "note",
)  # fmt: skip


def main(argv: list[str]) -> None:
    """Run the study on one scene and write charts, tables and plans to a folder."""
    what = "Reproduce the paper's coverage figures on a scene; name sensor types from the simplest to the best."
    options = study_parser("coverage", what).parse_args(argv)
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, Objective(count=1))
    )
    site, visible, folder = surveyed.site, surveyed.grid.visible, options.output
    steps = coverage_study(site, surveyed.models, visible, surveyed.settings.limits)
    study = watch.run("study", steps)
    claims = coverage_claims(study)

    with runtime.incomplete_if_interrupted(folder):
        save_study_table(folder / "coverage.csv", study)
        save_height_chart(folder / "heights.png", study, site.name)
        weighted = site.targets.central.any()
        if weighted:
            save_weight_chart(folder / "weights.png", study, site.name)
        for sensor in study.sensors:
            for weight in (1.0, CHARTED_WEIGHT) if weighted else (1.0,):
                case = study.find(sensor, COUNTS[-1], weight=weight)
                if case is not None:
                    name = f"plan_{sensor}_{'vanilla' if weight == 1.0 else 'weighted'}.png"
                    notes = [] if weight == 1.0 else [f"Optimised with weight {weight:g} in weighted regions."]
                    save_png(folder / name, draw_plan(surveyed.geometry, site, case.deployment, notes))
        save_claims(folder / "claims.md", claims, site.name)
    for claim in claims:
        runtime.print_line(claim.describe())
    runtime.print_line(f"written to {folder}/")


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
