"""Judgement of finalists of the panel, in a Python with PyTorch; `seip place --finalists` needs no file.

python -m headless.judge site.blend finalists.json judgement.json --traffic run-*.npz -o out/detection
"""

from dataclasses import asdict
from pathlib import Path

from headless import runtime
from headless.detection.judging import judge_finalists
from headless.options import add_settings, add_weather, new_parser

import bpy

from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.weather import weather_of
from seip_addon.core.storage.files import save_json
from seip_addon.core.workflows.judging import read_request
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.read import read_scene


def main(argv: list[str]) -> None:
    """Judge the finalists of a file in runs of traffic, and write the judgement to a file."""
    parser = new_parser("judge", "Choose among placements by what a detector finds with them.")
    parser.add_argument("scene", type=Path, help="the .blend")
    parser.add_argument("finalists", type=Path, help="file with the finalists")
    parser.add_argument("judgement", type=Path, help="file to write")
    parser.add_argument("--traffic", nargs="+", type=Path, required=True, metavar="NPZ", help="runs to judge in")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder in which detections are kept")
    add_settings(parser, SurveySettings, "catalogue")
    add_weather(parser)
    options = parser.parse_args(argv)
    runtime.check_folder(options.output)
    request, weather = read_request(options.finalists), weather_of(options.weather)
    runtime.open_scene(options.scene)
    geometry = weather.over(read_scene(bpy.context.scene).geometry)
    keys = sorted({sensor.sensor for one in request.finalists for sensor in one.sensors})
    known = find_models(load_catalogue(options.catalogue), keys)
    models = {key: weather.through(model) for key, model in known.items()}
    judgement = runtime.finish_with_bar(
        judge_finalists(geometry, request, models, weather, options.traffic, options.output)
    )
    save_json(options.judgement, asdict(judgement))


if __name__ == "__main__":
    runtime.run(main)
