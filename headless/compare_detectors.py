"""Chart what other settings of the detector cost and gain: average precision against training and inference time.

python -m headless.compare_detectors scenes/junction.blend -o docs/detector

Every setting trains for the same number of steps on all placements, and is judged on the same frames.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

from headless import evaluate, session, survey
from headless.detection import case_study
from headless.detection.detector import Detector
from headless.detection.inference import detect
from headless.detection.settings import PUBLISHED, NetworkSettings, TrainingSettings
from headless.detection.training import deterministic

import numpy as np

from seip_addon.core.pictures.detection_charts import Setting, save_setting_chart
from seip_addon.core.progress import finish
from seip_addon.core.storage import save_json

DEFAULT = NetworkSettings()
SETTINGS = {
    ("default", "default"): DEFAULT,
    ("pillars", "0.32 m"): replace(DEFAULT, pillar=0.32),
    ("pillars", "0.5 m"): replace(DEFAULT, pillar=0.5),
    ("points in a pillar", "8"): replace(DEFAULT, most_points=8),
    ("points in a pillar", "32"): replace(DEFAULT, most_points=32),
    ("width", "16"): replace(DEFAULT, width=16),
    ("width", "64"): replace(DEFAULT, width=64),
    ("head", "anchors"): replace(DEFAULT, head="anchor"),
    ("as published", "as published"): PUBLISHED,
}
"""What is compared: family and name, and the network."""

LOOKS = 5
"""Times that a frame is looked at, of which the median counts."""


def main(argv: list[str]) -> None:
    """Train and judge every setting, and write the chart and its figures."""
    options = _parser().parse_args(argv)
    stage = evaluate.set_stage(options)
    pupils, detectors, seconds = [], [], []
    for (family, name), network in SETTINGS.items():
        lessons = evaluate.learn_from(stage, network)
        training = TrainingSettings(steps=options.steps, validate_every=options.steps)
        file = f"{family} {name}".replace(" ", "-")
        pupil = case_study.Pupil(file, stage.configurations, network, training)
        begin = time.perf_counter()
        with session.progress_bar() as report:
            steps = case_study.train_all([pupil], lessons, options.output, device=options.device)
            detectors.append(finish(steps, report)[0].detector)
        seconds.append(time.perf_counter() - begin)
        pupils.append(pupil)
    judging = case_study.judge_all(stage.studio, pupils, detectors, stage.traffic)
    judgements = stage.surveyed.stopwatch.run("judgement", judging)
    settings = [
        Setting(
            name=name,
            family=family,
            training=trained,
            inference=1000 * _inference(stage, detector),
            average_precision=float(
                np.mean([one.evaluation.average_precision for one in judgements if one.pupil is pupil])
            ),
            default=pupil.network == DEFAULT,
        )
        for (family, name), trained, pupil, detector in zip(SETTINGS, seconds, pupils, detectors, strict=True)
    ]
    title = f"{stage.surveyed.site.name}: mean over {len(stage.configurations)} placements, {options.steps} steps"
    with session.writing(options.output):
        save_setting_chart(options.output / "settings.png", settings, title)
        save_json(options.output / "settings.json", [vars(setting) for setting in settings])
    for setting in settings:
        session.say(
            f"{setting.family}, {setting.name}: AP {setting.average_precision:.1%}, "
            f"training {setting.training:.0f} s, inference {setting.inference:.0f} ms"
        )


def _inference(stage: evaluate.Stage, detector: Detector) -> float:
    """Return the seconds that detection takes in a merged frame: the mean over configurations of each one's median."""
    medians = []
    for configuration in stage.configurations:
        frame = stage.studio.frame(configuration, stage.traffic.test[0], 0)
        looks = []
        for _ in range(LOOKS):
            begin = time.perf_counter()
            with deterministic(TrainingSettings().threads):
                detect(detector, frame.points, frame.intensity)
            looks.append(time.perf_counter() - begin)
        medians.append(np.median(looks))
    return float(np.mean(medians))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="compare_detectors", description=__doc__.splitlines()[0], formatter_class=survey.HelpWithDefaults
    )
    evaluate.add_options(parser)
    parser.set_defaults(steps=600)
    return parser


if __name__ == "__main__":
    session.run(main)
