"""Build a Blender scene from an OpenDRIVE map or an extract of OpenStreetMap.

blender -b --python-exit-code 1 -P headless/build_scene.py -- map.xodr --near -49 -1 --radius 80 -o site.blend
seip build-scene place.osm --near-latlon 52.47391,13.44048 -o site.blend
seip build-scene --at 52.47391,13.44048 -o site.blend
seip build-scene place.osm --junction "One Street" "Other Street" -o site.blend
seip build-scene map.xodr --junction 53 --site site.toml -o site.blend
seip build-scene site.toml -o site.blend
seip build-scene place.osm --near-latlon 51.906 4.456 --terrain dem.tif -o a.blend
"""

import argparse
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import NUMBER, add_settings, new_parser

from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.programs.sumo_programs import NETWORK_SUFFIX
from seip_addon.core.site.sources import source_lines
from seip_addon.core.storage.files import locked
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.world.openstreetmap.map_links import parsed_position
from seip_addon.core.world.openstreetmap.overpass import OVERPASS, OverpassServer, user_cache
from seip_addon.scene.blend_file import check_name, new_file, save_blend
from seip_addon.scene.build import build_scene


def main(argv: list[str]) -> None:
    """Read the source, model the site and save it."""
    request = _parser().parse_args(argv)
    check_name(request.output)
    with locked(request.output, folder=False):
        _build(request)


def _build(request: argparse.Namespace) -> None:
    map_path = request.output.with_suffix(NETWORK_SUFFIX)
    for path in (request.output, map_path):
        if path.is_dir():
            raise SeipError(f"{path} is a folder, and a file of that name would be written; choose another name")
    with runtime.progress_bar() as report:
        built = finish(build_site(request.source, _asked_site(request), map_path), report)
        model = built.model
        scene = new_file()
        finish(build_scene(scene, model, built.map_name), report)
    save_map(built, map_path)
    save_blend(request.output)
    for note in model.notes:
        runtime.print_line(f"note: {note}")
    runtime.warn(model.warnings)
    for line in source_lines(model.sources()):
        runtime.print_line(line)
    x, y, z = model.origin + 0.0  # no negative zero
    runtime.print_line(
        f"{request.output}: {model.name}, {counted(len(model.parts), 'object')}, "
        f"region of interest {model.region.area:.0f} m², local origin at map ({x:.0f}, {y:.0f}, {z:.0f})"
    )
    if built.map_text is not None:
        runtime.print_line(f"{map_path}: the network of its streets, to simulate traffic on")


def _asked_site(options: argparse.Namespace) -> SiteRequest:
    near_latlon = None if options.near_latlon is None else tuple(options.near_latlon)
    if options.at:
        near_latlon = parsed_position(" ".join(options.at))
    return SiteRequest(
        near=None if options.near is None else tuple(options.near),
        near_latlon=near_latlon,
        junction=tuple(options.junction),
        radius=options.radius,
        approaches=options.approaches,
        level=tuple(options.level),
        site=options.site,
        osm=options.osm,
        terrain=options.terrain,
        service=options.service_roads,
        left_hand=None if options.traffic_keeps is None else options.traffic_keeps == "left",
        overpass=_server(options) if options.at and options.source is None else None,
    )


def _server(options: argparse.Namespace) -> OverpassServer:
    return OverpassServer(user_cache(), options.overpass, runtime.why_offline())


def _text_or_number(text: str) -> str:
    """Return a text; the name of this type lets an option take numbers with commas, and negative ones."""
    return text


_text_or_number.__name__ = NUMBER


def _parser() -> argparse.ArgumentParser:
    parser = new_parser(
        "seip build-scene", "Build a Blender scene from an OpenDRIVE map or an extract of OpenStreetMap."
    )
    parser.add_argument(
        "source",
        type=Path,
        nargs="?",
        help="map (.xodr), extract (.osm, .osm.gz, .osm.pbf) or site description (.toml) with the name of a map; "
        "none with --at, to download an extract",
    )
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--near",
        type=float,
        nargs=2,
        metavar=("X", "Y"),
        help="centre of the site in map coordinates, metres",
    )
    place.add_argument(
        "--near-latlon",
        type=float,
        nargs=2,
        metavar=("LAT", "LON"),
        help="latitude and longitude in degrees; the nearest junction is studied",
    )
    place.add_argument(
        "--at",
        type=_text_or_number,
        nargs="+",
        metavar="PLACE",
        help="latitude and longitude, or a link of a web map in quotes; without a file the extract is downloaded",
    )
    place.add_argument(
        "--junction",
        nargs="+",
        default=[],
        metavar="NAME",
        help="id or name of the junction, or the names of two streets that meet there",
    )
    parser.add_argument(
        "--overpass", default=OVERPASS, metavar="URL", help="Overpass server that extracts are downloaded from"
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--radius", type=float, help="radius of the region of interest in metres (80 with --near)")
    size.add_argument(
        "--approaches",
        type=float,
        metavar="M",
        help="length of the approaches in the region of interest, metres (80 with --junction)",
    )
    parser.add_argument(
        "--level",
        nargs="+",
        default=[],
        metavar="STREET",
        help="street or road id on the level to study, where roads cross on several levels",
    )
    parser.add_argument("--site", type=Path, metavar="TOML", help="site description with objects that the map lacks")
    add_settings(parser, SiteRequest, "osm", "terrain")
    parser.add_argument(
        "--service-roads", action="store_true", help="treat driveways, aisles and alleys of an extract as streets"
    )
    parser.add_argument(
        "--traffic-keeps",
        choices=("left", "right"),
        help="side of traffic in an extract (default: from the extract, or from its country)",
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BLEND", help="the .blend to write")
    return parser


if __name__ == "__main__":
    runtime.run(main)
