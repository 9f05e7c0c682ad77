"""Average precision at unseen sites, with all ingredients of a training and without each.

seip study random-sites -o out/sites --sites 20
seip study ingredients out/sites/*/site.blend --unseen scenes/junction.blend -o out/ingredients

The runs of traffic of each scene are in the folder SCENE_traffic next to it. Rerun the command to resume interrupted
trainings.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from headless import runtime
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.options import add_settings, new_parser, read_settings, real_number
from headless.studies.ingredients.charts import IngredientMark, save_ingredients_chart
from headless.studies.ingredients.learning import TrainingSites, covering_most, train_variants
from headless.studies.ingredients.unseen_sites import IngredientEffect, UnseenTest, effects, unseen_tests
from headless.studies.ingredients.variants import ALL, VARIANTS
from headless.studies.site_training.command import LearningSettings, read_site, set_aside

from seip_addon.core.limits import TIME_STEP
from seip_addon.core.storage.csv_table import save_csv

TEST_STRIDE = 2  # time between test frames, in multiples of that between training frames


def main(argv: list[str]) -> None:
    """Train every variant, test it at unseen sites, and write table and chart."""
    options = _parser().parse_args(argv)
    training = replace(read_settings(TrainingSettings, options), validate_every=options.steps)
    learning = LearningSettings(placements=1, every=options.every, seed=options.placement_seed)
    folder = options.output
    runtime.check_folder(folder)
    training_scenes, aside = set_aside(options.scenes)
    sites = TrainingSites(
        tuple(read_site(scene, learning) for scene in training_scenes),
        tuple(read_site(scene, learning) for scene in aside),
        folder,
        learning.seed,
    )
    tests: list[UnseenTest] = []
    for number, scene in enumerate(options.unseen):
        site = read_site(scene, replace(learning, every=TEST_STRIDE * learning.every))
        best = runtime.finish_with_bar(covering_most(site.geometry, folder / f"visibility-{scene.stem}.npz"))
        tests += unseen_tests(site, best, learning.seed, full=number == 0)
    detectors = runtime.finish_with_bar(train_variants(sites, VARIANTS, NetworkSettings(), training, options.trainings))
    found = runtime.finish_with_bar(effects(tests, VARIANTS, detectors))
    with runtime.incomplete_if_interrupted(folder):
        save_table(folder / "ingredients.csv", found)
        what = f"{options.steps:,} steps, {len(sites.training)} sites"
        marks = [IngredientMark(one.test, one.variant, one.change) for one in found if one.change is not None]
        save_ingredients_chart(folder / "ingredients.png", marks, f"Without each ingredient: {what}")
    for one in found:
        runtime.print_line(describe_effect(one))
    runtime.print_line(f"written to {folder}/")


def describe_effect(one: IngredientEffect) -> str:
    """Return a row of the table as a message."""
    against = "" if one.change is None else f", {one.change.as_points(1)} against {ALL}"
    return f"{one.test}: {one.variant}: AP {one.precision.describe(1)}{against}"


def save_table(path: Path, found: list[IngredientEffect]) -> None:
    """Write a row for each test and variant as CSV."""
    rows = []
    for one in found:
        estimates = [one.precision, one.change]
        figures = [
            "" if estimate is None else f"{getattr(estimate, end):.4f}"
            for estimate in estimates
            for end in ("value", "low", "high")
        ]
        rows.append([one.test, one.variant, *figures])
    save_csv(path, ["test", "variant", "ap", "ap_low", "ap_high", "change", "change_low", "change_high"], rows)


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study ingredients", "Train with all ingredients and without each; test at unseen sites.")
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE", help="training scenes, each with its traffic")
    parser.add_argument(
        "--unseen", nargs="+", type=Path, required=True, metavar="SCENE", help="test scenes, each with its traffic"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for table, chart and trainings")
    parser.add_argument(
        "--every", type=real_number(TIME_STEP), default=2.5, metavar="S", help="time between frames, seconds"
    )
    parser.add_argument("--placement-seed", type=int, default=1, metavar="N", help="seed of random placements")
    add_settings(parser, TrainingSettings, "steps", "batch")
    parser.add_argument(
        "--trainings", type=int, default=3, metavar="N", help="trainings of each variant, with different seeds"
    )
    parser.set_defaults(steps=600)
    return parser
