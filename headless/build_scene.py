"""Build a Blender scene from an OpenDRIVE map.

blender -b --python-exit-code 1 -P headless/build_scene.py -- map.xodr --near -49 -1 --radius 80 -o site.blend
python -m headless.build_scene map.xodr --junction 53 --site site.toml -o site.blend
python -m headless.build_scene site.toml -o site.blend
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime

from seip_addon.core.opendrive import read_map
from seip_addon.core.progress import finish
from seip_addon.core.streetscape.description import describe_place
from seip_addon.core.streetscape.model import site_model
from seip_addon.scene.blend_file import check_name, new_file, save_blend
from seip_addon.scene.build import build_scene


def main(argv: list[str]) -> None:
    """Read the map and the site description, model the site and save it."""
    asked = _parser().parse_args(argv)
    near = None if asked.near is None else (asked.near[0], asked.near[1])
    map_path, description = describe_place(
        asked.source,
        site=asked.site,
        near=near,
        junction=asked.junction,
        radius=asked.radius,
        approaches=asked.approaches,
    )
    if asked.level:
        description = replace(description, level=tuple(asked.level))
    check_name(asked.output)
    with runtime.progress_bar() as report:
        model = finish(site_model(read_map(map_path), description), report)
        finish(build_scene(new_file(), model, map_path.name), report)
    save_blend(asked.output)
    for note in model.notes:
        runtime.print_line(f"note: {note}")
    runtime.warn(model.warnings)
    x, y, z = model.origin + 0.0  # no negative zero
    runtime.print_line(
        f"{asked.output}: {model.name}, {len(model.parts)} objects, region of interest {model.region.area:.0f} m², "
        f"local origin at map ({x:.0f}, {y:.0f}, {z:.0f})"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="build_scene", description="Build a Blender scene from an OpenDRIVE map.")
    parser.add_argument("source", type=Path, help="the map (.xodr), or a site description (.toml) that names it")
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--near",
        type=float,
        nargs=2,
        metavar=("X", "Y"),
        help="middle of the place, map coordinates in metres (or latitude and longitude)",
    )
    place.add_argument("--junction", metavar="ID", help="id or name of the junction in the middle of the place")
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--radius", type=float, help="radius of the region of interest in metres (80 with --near)")
    size.add_argument(
        "--approaches",
        type=float,
        metavar="M",
        help="how far the region follows the approaches of the junction in metres (80 with --junction)",
    )
    parser.add_argument(
        "--level",
        nargs="+",
        default=[],
        metavar="ROAD",
        help="id of a road on the level to study, where roads cross above",
    )
    parser.add_argument("--site", type=Path, metavar="TOML", help="site description: what the map does not have")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BLEND", help="the .blend to write")
    return parser


if __name__ == "__main__":
    runtime.run(main)
