"""Average precision against training and inference time for alternative detector settings.

seip study detector-settings scenes/junction.blend -o out/detectors

Every setting is trained for the same number of steps on all placements, and evaluated on the same frames. Times are
CPU times of one thread, independent of other load.
"""

import argparse
import time
from collections.abc import Generator
from dataclasses import replace

from headless import runtime
from headless.detection.detector import Detector
from headless.detection.inference import seconds_of
from headless.detection.recordings import Simulator
from headless.detection.run_detection import AT_ONCE
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import deterministic
from headless.options import new_parser
from headless.side_by_side import side_by_side
from headless.studies.detection import case_study
from headless.studies.detection import command as evaluate
from headless.studies.precision_charts import DetectorSetting, save_setting_chart

import numpy as np

from seip_addon.core.progress import Progress
from seip_addon.core.storage.files import save_json

PUBLISHED_NETWORK = NetworkSettings(pillar=0.24, most_points=32, width=64, blocks=(3, 5, 5), head="anchor")
"""Network of the SEIP paper: 0.24 m pillars of 32 points, blocks of 3, 5, 5 at 64, 128, 256 channels, anchors."""

DEFAULT_NETWORK = NetworkSettings()
NETWORKS = {
    ("as published", "as published"): PUBLISHED_NETWORK,  # slowest, so it starts first
    ("default", "default"): DEFAULT_NETWORK,
    ("pillars", "0.4 m"): replace(DEFAULT_NETWORK, pillar=0.4),
    ("pillars", "0.5 m"): replace(DEFAULT_NETWORK, pillar=0.5),
    ("points in a pillar", "8"): replace(DEFAULT_NETWORK, most_points=8),
    ("points in a pillar", "32"): replace(DEFAULT_NETWORK, most_points=32),
    ("width", "20"): replace(DEFAULT_NETWORK, width=20),
    ("width", "80"): replace(DEFAULT_NETWORK, width=80),
    ("head", "anchors"): replace(DEFAULT_NETWORK, head="anchor"),
}
"""Networks compared, by family and name of the setting."""


def main(argv: list[str]) -> None:
    """Train and evaluate a detector with every setting, and write the chart and its data."""
    options = _parser().parse_args(argv)
    study = evaluate.prepare_study(options)
    models = [
        case_study.ModelConfiguration(
            f"{family} {name}",
            study.configurations,
            network,
            TrainingSettings(steps=options.steps, validate_every=options.steps),
        )
        for (family, name), network in NETWORKS.items()
    ]
    trainings = [_train(study, model, options.device) for model in models]
    with deterministic(1):
        trained = study.stopwatch.run("training", side_by_side(trainings, AT_ONCE))
    detectors = [detector for detector, _ in trained]
    evaluation = case_study.evaluate_all(study.simulator, models, detectors, study.traffic)
    outcomes = study.stopwatch.run("evaluation", evaluation)
    settings = [
        DetectorSetting(
            name=name,
            family=family,
            training=seconds,
            inference=1000 * _inference_seconds(study, detector),
            average_precision=float(
                np.mean([outcome.evaluation.average_precision for outcome in outcomes if outcome.model is model])
            ),
            default=model.network == DEFAULT_NETWORK,
        )
        for (family, name), model, (detector, seconds) in zip(NETWORKS, models, trained, strict=True)
    ]
    title = f"{study.surveyed.site.name}: mean over {len(study.configurations)} placements, {options.steps} steps"
    with runtime.incomplete_if_interrupted(options.output):
        save_setting_chart(options.output / "settings.png", settings, title)
        save_json(options.output / "settings.json", [vars(setting) for setting in settings])
    for setting in settings:
        runtime.print_line(
            f"{setting.family}, {setting.name}: AP {setting.average_precision:.1%}, "
            f"training {setting.training:.0f} s, inference {setting.inference:.0f} ms"
        )


def _train(
    study: evaluate.DetectionStudy, model: case_study.ModelConfiguration, device: str
) -> Generator[Progress, None, tuple[Detector, float]]:
    """Simulate the training set and train a detector on it; return it with the CPU time of the training in seconds."""
    simulator = Simulator(study.surveyed.geometry, study.simulator.settings)
    training_set = yield from case_study.simulate_training_set(
        simulator, model.configurations, study.traffic, model.network
    )
    simulator.forget()
    begin = time.thread_time()
    trained = yield from case_study.training(model, training_set, device=device)
    return trained.detector, time.thread_time() - begin


def _inference_seconds(study: evaluate.DetectionStudy, detector: Detector) -> float:
    """Return the CPU time of inference on a merged frame: the median of runs, averaged over configurations."""
    seconds = []
    for configuration in study.configurations:
        frame = study.simulator.frame(configuration, study.traffic.test[0], 0)
        area = study.simulator.area(detector.settings.pillar)
        with deterministic(1):
            seconds.append(seconds_of(detector, area, frame, time.thread_time))
    return float(np.mean(seconds))


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study detector-settings", __doc__.splitlines()[0])
    evaluate.add_options(parser)
    parser.set_defaults(steps=600, every=5.0)
    return parser
