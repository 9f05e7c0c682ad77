"""Comparison of placement criteria by detection: a table over sites, sensor types and counts.

seip study criteria scenes/junction.blend site.blend --sensor os1_128 vlp16 --count 1 2 4 -o out/criteria

Needs torch (make detection), and runs of traffic in the folder SCENE_traffic beside each scene. The shipped detector is
used without further training: it was trained on random sites only. An interrupted study resumes.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from headless import runtime, survey
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.recordings import SampledRun, Simulator, sampled_runs
from headless.options import real_number, whole_number
from headless.studies.criteria.criteria_table import (
    CriteriaStudySettings,
    study_type,
    table_cells,
    table_lines,
)
from headless.studies.criteria.site_criteria import CRITERIA
from headless.studies.detection.case_study import MIN_RUNS
from headless.studies.survey_options import study_parser

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import COUNT, SEED, SENSORS, TIME_STEP
from seip_addon.core.choosing.placement.objective import Objective, check_objective
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import digest, save_json
from seip_addon.core.storage.source_digest import source_digest

SCHEMA = "seip-criteria-study/1"
TYPE_FILE = "criteria.json"
RUNS_PER_CRITERIA = 4  # one run in 4 is for criteria that use traffic, the others for tests


def main(argv: list[str]) -> None:
    """Study each sensor type on each site, and write the table after each of them."""
    options = _parser().parse_args(argv)
    settings = CriteriaStudySettings(
        tuple(options.count), options.placements, tuple(options.criterion), options.placement_seed
    )
    settings.check()
    folder, scenes = options.output, [options.scene, *options.scenes]
    if options.scene is None:
        raise SeipError("name one scene or more, each with its runs of traffic in the folder SCENE_traffic beside it")
    names = [scene.stem for scene in scenes]
    if len(set(names)) < len(names):
        raise SeipError("two scenes have files of one name, and would share a folder of results: rename one")
    runtime.check_folder(folder)
    studied: list[Mapping[str, Any]] = []
    for sensor in options.sensor:
        for scene in scenes:
            own = argparse.Namespace(**vars(options))
            own.scene, own.sensor, own.output = scene, [sensor], folder / scene.stem / sensor
            studied.append(_study(own, settings))
            rows = [row for one in studied for row in one["rows"]]
            save_csv(folder / "criteria.csv", list(rows[0]), table_cells(rows))
            save_json(folder / "criteria.json", {"schema": SCHEMA, "types": studied})
            for line in table_lines(studied[-1]["rows"]):
                runtime.print_line(line)
    runtime.print_line(f"written to {folder}/")


def _study(options: argparse.Namespace, settings: CriteriaStudySettings) -> Mapping[str, Any]:
    """Return the record of one sensor type on one site, from its file where that follows from the same."""
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, Objective(count=max(settings.counts)))
    )
    runs = sampled_runs(survey.runs_beside(options.scene), surveyed.geometry.origin, options.every)
    known, tests = _split(runs)
    check_runs([run.trajectories for run in runs], surveyed.site.region)
    for run in runs:
        require_own_traffic(run.trajectories, surveyed.geometry, run.name)
    scans = ScanSettings(seed=options.scan_seed, rolling_shutter=True)
    settings_record = {
        **surveyed.settings.as_record(),
        **vars(settings),
        "frames_every_s": options.every,
        "scan_seed": options.scan_seed,
    }
    detector = Detector.load(SHIPPED_DETECTOR)
    key = digest(
        *(
            source_digest("headless.detection", "headless.studies.criteria"),
            surveyed.grid.key,
            detector.key,
            json.dumps(settings_record, default=str),
        ),
        *(run.key for run in runs),
    )
    path = options.output / TYPE_FILE
    record = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if record.get("key") == key:
        return dict(record)
    found = watch.run(
        "study",
        study_type(
            surveyed,
            Simulator(surveyed.geometry, scans),
            (known, tests),
            detector,
            settings,
            options.output,
        ),
    )
    record = {
        "key": key,
        "site": found.site,
        "sensor": found.sensor,
        "settings": settings_record,
        "versions": versions(blender=bpy.app.version_string),
        "test_runs": len(tests),
        "test_frames": sum(len(run.times) for run in tests),
        "seconds": round(watch.seconds["study"]),
        "rows": list(found.rows()),
        "placements": list(found.placements()),
    }
    save_json(path, record)
    return record


def _split(runs: Sequence[SampledRun]) -> tuple[Sequence[SampledRun], Sequence[SampledRun]]:
    """Split runs: the first quarter (at least one) for criteria, the others for tests."""
    if len(runs) < MIN_RUNS:
        raise SeipError(f"{len(runs)} runs of traffic are too few: make {MIN_RUNS} or more with seip traffic")
    count = max(1, len(runs) // RUNS_PER_CRITERIA)
    return runs[:count], runs[count:]


def _parser() -> argparse.ArgumentParser:
    what = "Compare the criteria by which sensors can be placed by what a detector finds with them."
    parser = study_parser("criteria", what)
    parser.add_argument("scenes", nargs="*", type=Path, help="more scenes")
    study = parser.add_argument_group("study")
    study.add_argument("--count", nargs="+", type=whole_number(SENSORS), default=[1, 2, 4], metavar="N", help="sensors")
    study.add_argument(
        "--placements",
        type=whole_number(COUNT),
        default=30,
        metavar="N",
        help="drawn ones of each count, next to those that criteria rate best; 0: none",
    )
    study.add_argument(
        "--criterion",
        nargs="+",
        choices=CRITERIA,
        default=CRITERIA,
        metavar="KEY",
        help=f"compared with coverage: {', '.join(CRITERIA[1:])} (all)",
    )
    study.add_argument("--placement-seed", type=whole_number(SEED), default=0, metavar="SEED", help="of what is drawn")
    study.add_argument(
        "--every", type=real_number(TIME_STEP), default=20.0, metavar="S", help="time from frame to frame in tests"
    )
    study.add_argument("--scan-seed", type=whole_number(SEED), default=0, help="of noise and lost returns")
    return parser
