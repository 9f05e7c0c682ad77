"""Coverage of sensor types × heights × numbers on any scene, vanilla against weighted.

seip study coverage scenes/junction.blend -o out/study
blender -b --python-exit-code 1 site.blend -P headless/study.py -- coverage -o out/study
"""

import argparse

from headless import runtime, survey
from headless.options import new_parser
from headless.studies.claims import save_claims
from headless.studies.coverage.cells import CHARTED_WEIGHT, COUNTS, coverage_study
from headless.studies.coverage.charts import save_height_chart, save_weight_chart
from headless.studies.coverage.claims import coverage_claims
from headless.studies.coverage.tables import save_study_table
from headless.studies.survey_options import add_survey_options

from seip_addon.core.choosing.placement.objective import Objective, check_objective
from seip_addon.core.output.pictures.plan_view import save_plan_view


def main(argv: list[str]) -> None:
    """Run the study on one scene and write charts, tables and plans to a folder."""
    options = _parser().parse_args(argv)
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
                    save_plan_view(folder / name, surveyed.geometry, site, case.deployment, notes)
        save_claims(folder / "claims.md", claims, site.name)
    for claim in claims:
        runtime.print_line(claim.describe())
    runtime.print_line(f"written to {folder}/")


def _parser() -> argparse.ArgumentParser:
    what = "Reproduce the paper's coverage figures on a scene; name sensor types from the simplest to the best."
    parser = new_parser("study coverage", what)
    add_survey_options(parser)
    return parser
