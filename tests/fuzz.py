"""Hostile files of each format, seeded: a reader gives a result or a SeipError, and nothing else.

Numbers of a result are finite and within `core.limits`: an accepted file with any other number is a fault.

    python -m tests.fuzz --count 1000            # of each format
    python -m tests.fuzz map sweep.npz --count 5000 --seed 7
    python -m tests.fuzz --minutes 60              # with further seeds, for an hour

Inputs are read in a process of their own, so that one that hangs, crashes or fills the memory is counted and named
like the rest; ``--keep DIR`` writes what was at fault. Crashes within Blender's own reader are counted, and no fault
of this project. A mutation that makes a file contradict itself says so, and
then a result is a fault too. Status 1 where there was any.
"""

from __future__ import annotations

import argparse
import gzip
import io
import json
import os
import re
import resource
import select
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

SECONDS = 60.0
"""After which an input hangs."""

SLOW_SECONDS = 400.0
"""The same for formats that are read in a process of their own, which has 300 s."""

MEMORY = 12 << 30
"""Bytes of address space that a reader may take."""

Random = np.random.Generator

NUMBERS = ("nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "0", "-0.0", "-1", "1e9", "-1e9", "99999999999999999999")
WORDS = ("", " ", "x", "\N{SNOWMAN}", "true", "driving", "../../etc/passwd", "a" * 5000, "%s%n", "\x7f", "0x10", "1_0")
PIECES = (b"\x00", b"\xff\xfe", b"<", b">", b"&", b'"', b"'", b"]]>", b"<!--", b"[", b"{", b"\n", b"\r", b";", b"=")


@dataclass(frozen=True)
class Case:
    """A hostile file, and whether no result may come of it."""

    content: bytes
    contradicts: bool = False


@dataclass(frozen=True)
class Format:
    """A format: the sound files that are mutated, how, what reads them, and which share of the inputs is tried."""

    suffixes: tuple[str, ...]
    samples: Callable[[Path], list[bytes]]
    mutate: Callable[[Random, bytes], Case]
    read: Callable[[Path, bytes], None]
    share: float = 1.0


def mutated_bytes(random: Random, content: bytes) -> bytes:
    """Flip bits, put in, take out, double, cut: one to four times."""
    data = bytearray(content)
    for _ in range(int(random.integers(1, 5))):
        at = int(random.integers(len(data) + 1))
        length = int(2 ** random.uniform(0, np.log2(len(data) + 2)))
        kind = int(random.integers(7))
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << int(random.integers(8))
        elif kind == 1 and data:
            data[at % len(data)] = int(random.integers(256))
        elif kind == 2:
            data[at:at] = PIECES[int(random.integers(len(PIECES)))]
        elif kind == 3:
            del data[at : at + length]
        elif kind == 4:
            data[at:at] = data[at : at + length]
        elif kind == 5:
            other = int(random.integers(len(data) + 1))
            data[at:at] = data[other : other + length]
        else:
            del data[at:]
    return bytes(data)


def mutated_text(random: Random, content: bytes) -> bytes:
    """Put other numbers and words in place of those of a text; bytes as well, now and then."""
    if random.random() < 0.2:
        return mutated_bytes(random, content)
    text = content.decode("utf-8", "surrogateescape")
    for _ in range(int(random.integers(1, 4))):
        kind = random.random() ** 2
        pattern = (
            r"-?\d+\.?\d*(?:e[-+]?\d+)?" if kind < 0.6 else r"[A-Za-z_]\w*" if kind < 0.8 else r"<[^<>]*>|[^\n]+\n"
        )
        found = list(re.finditer(pattern, text))
        if not found:
            break
        match = found[int(random.integers(len(found)))]
        text = text[: match.start()] + _in_place_of(random, match[0], kind) + text[match.end() :]
    return text.encode("utf-8", "surrogateescape")


def _in_place_of(random: Random, token: str, kind: float) -> str:
    if kind >= 0.8:
        return "" if random.random() < 0.5 else token * int(random.integers(2, 4))
    if kind >= 0.6 or random.random() < 0.2:
        return WORDS[int(random.integers(len(WORDS)))]
    if random.random() < 0.5:
        return NUMBERS[int(random.integers(len(NUMBERS)))]
    return repr(float(token) * float(10.0 ** random.uniform(-3, 5)) * (-1.0 if random.random() < 0.3 else 1.0))


def _changed(random: Random, text: str, pattern: str, values: tuple[str, ...]) -> bytes:
    """Return a text with one of the places of a pattern's first group taken by a value."""
    found = list(re.finditer(pattern, text))
    match = found[int(random.integers(len(found)))]
    value = values[int(random.integers(len(values)))]
    return (text[: match.start(1)] + value + text[match.end(1) :]).encode()


def _with_wrong_values(share: float, pattern: str, values: tuple[str, ...]) -> Callable[[Random, bytes], Case]:
    """Return a mutation of texts: for a share of them a wrong value at a place of a pattern, for the others any."""

    def mutate(random: Random, content: bytes) -> Case:
        if random.random() < share:
            return Case(_changed(random, content.decode(), pattern, values), contradicts=True)
        return Case(mutated_text(random, content))

    return mutate


def require_physical(value: object, where: str = "result", *, most: float = 1e15) -> None:  # noqa: C901
    """Check that all numbers in a result of a reader are finite and of a sensible size, through all its parts.

    NaN stands for what is not known in `elevation` rasters, whose fields are named ``heights``.
    """
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            known = value[~np.isnan(value)] if where.endswith(".heights") else value
            assert np.isfinite(known).all(), f"{where} holds a number that is not finite"
            assert not known.size or np.abs(known).max() <= most, f"{where} holds {np.abs(known).max():g}"
    elif isinstance(value, float):
        assert np.isfinite(value), f"{where} is {value}"
        assert abs(value) <= most, f"{where} is {value:g}"
    elif isinstance(value, Mapping):
        for key, part in value.items():
            require_physical(part, f"{where}.{str(key)[:20]}", most=most)
    elif isinstance(value, tuple | list):
        for part in value:
            require_physical(part, where, most=most)
    elif is_dataclass(value):
        for each in fields(value):
            require_physical(getattr(value, each.name), f"{where}.{each.name}", most=most)
    elif isinstance(value, BaseGeometry):
        require_physical(shapely.get_coordinates(value, include_z=value.has_z), where, most=most)


NOT_FINITE = ("nan", "inf", "-inf", "1e999", "x", "")


# --- maps and site descriptions


def _maps(_: Path) -> list[bytes]:
    from tests.builders.street_map import street_map  # noqa: PLC0415  # each reader loads what it needs

    furniture = (
        '<object id="1" type="building" s="30" t="20" zOffset="0" length="10" width="8" height="9" hdg="0.1"/>'
        '<object id="2" type="tree" s="50" t="9" zOffset="0" radius="2" height="9"/>'
        '<object id="3" type="pole" s="70" t="7" zOffset="0" radius="0.1" height="6"/>'
        '<object id="4" type="crosswalk" s="90" t="0" length="4" width="7"><outline>'
        '<cornerLocal u="-2" v="-3.5" z="0"/><cornerLocal u="2" v="-3.5" z="0"/><cornerLocal u="2" v="3.5" z="0"/>'
        "</outline></object>"
    )
    signals = '<signal id="1" s="98" t="-6" type="1000001" subtype="-1" dynamic="yes" zOffset="4" orientation="+"/>'
    return [
        street_map(kerb=0.12, furniture=furniture, signals=signals, grade=0.02).encode(),
        street_map(lane_types=("driving", "biking", "sidewalk")).encode(),
        street_map(furniture=furniture).encode(),
    ]


_mutate_map = _with_wrong_values(0.15, r'<geometry [^>]*?(?:x|y|hdg|length)="([^"]*)"', NOT_FINITE)


def _read_map(path: Path, _: bytes) -> None:
    from seip_addon.core.progress import finish  # noqa: PLC0415
    from seip_addon.core.world.opendrive.read import read_map  # noqa: PLC0415
    from seip_addon.core.world.streetscape.description import describe_place  # noqa: PLC0415
    from seip_addon.core.world.streetscape.model import site_model  # noqa: PLC0415

    _, description = describe_place(path, near=(0.0, 0.0), radius=30.0)
    model = finish(site_model(read_map(path), description))
    for part in model.parts:
        require_physical([part.solid.vertices, part.foot, part.yaw], "model part", most=1e6)


def _descriptions(_: Path) -> list[bytes]:
    return [(ROOT / "scenes" / f"{name}.toml").read_bytes() for name in ("junction", "corridor")]


def _mutate_description(random: Random, content: bytes) -> Case:
    if random.random() < 0.15:
        values = ("nan", "inf", "-3", '"far"', "[]")
        return Case(_changed(random, f"radius = 50\n{content.decode()}", r"radius = (\S+)", values), contradicts=True)
    return Case(mutated_text(random, content))


def _read_description(path: Path, _: bytes) -> None:
    from seip_addon.core.world.streetscape.description import read_site_description  # noqa: PLC0415

    require_physical(read_site_description(path))


def _catalogues(_: Path) -> list[bytes]:
    return [(ROOT / "seip_addon" / "core" / "sensing" / "lidar" / "catalogue.toml").read_bytes()]


_mutate_catalogue = _with_wrong_values(
    0.15, r"(?:points_per_second|rotation_rate_hz) = ([\d.]+)", ("nan", "inf", "-1", "0", '"x"')
)


def _read_catalogue(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.lidar.catalogue import load_catalogue  # noqa: PLC0415

    for model in load_catalogue([path]).values():
        require_physical(replace(model, price_range=model.price_range))


# --- measurements of sensors


def _measurements(_: Path) -> list[bytes]:
    from tests.builders.measured_sensor import LAW, measured  # noqa: PLC0415

    return [json.dumps(measured(LAW)).encode()]


def _mutate_text(random: Random, content: bytes) -> Case:
    return Case(mutated_text(random, content))


def _read_measurements(path: Path, _: bytes) -> None:
    from headless.studies.calibration.reference import load_reference  # noqa: PLC0415

    require_physical(load_reference(path))


# --- SUMO's files


def _floating_car_data(_: Path) -> list[bytes]:
    from tests.builders.sumo_text import CONVERTED_CSV, FCD, NATIVE_CSV  # noqa: PLC0415

    return [text.encode() for text in (FCD, NATIVE_CSV, CONVERTED_CSV)] + [gzip.compress(FCD.encode(), mtime=0)]


def _mutate_floating_car_data(random: Random, content: bytes) -> Case:
    if content.startswith(b"<") and random.random() < 0.15:
        values = (*NOT_FINITE, "1e300") if random.random() < 0.8 else ("-7",)
        pattern = r'timestep time="([1-9][\d.]*|0\.[24]0)"' if values == ("-7",) else r'(?:x|y|angle)="([^"]*)"'
        return Case(_changed(random, content.decode(), pattern, values), contradicts=True)
    return Case(mutated_bytes(random, content) if content.startswith(b"\x1f") else mutated_text(random, content))


def _read_floating_car_data(path: Path, content: bytes) -> None:
    from seip_addon.core.progress import finish  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.floating_car_data import read_floating_car_data, read_trajectories  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.trajectories import Trajectories  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.vehicle_types import BUILT_IN  # noqa: PLC0415

    table = path.with_suffix(".csv")  # which form it is goes by the name
    if not content.lstrip().startswith((b"<", b"\x1f")):
        path = path.rename(table)
    data = finish(read_floating_car_data(path))
    got, _ = read_trajectories(data, BUILT_IN, np.zeros(3), "fuzz")
    ground = replace(got, position=np.where(np.isnan(got.position), 0.0, got.position))
    require_physical(ground, most=1e11)
    ground.save(path.with_suffix(".npz"))
    assert Trajectories.load(path.with_suffix(".npz")).key == ground.key, "trajectories other than those written"


def _routes(_: Path) -> list[bytes]:
    from tests.builders.sumo_text import NET, ROUTES  # noqa: PLC0415

    return [ROUTES.encode(), NET.encode()]


def _mutate_routes(random: Random, content: bytes) -> Case:
    if b"vType " in content and random.random() < 0.15:
        values = (*NOT_FINITE[:-1], "0", "-1", "1e9")
        return Case(_changed(random, content.decode(), r'(?:length|width|height)="([^"]*)"', values), contradicts=True)
    return Case(mutated_text(random, content))


def _read_routes(path: Path, content: bytes) -> None:
    from seip_addon.core.progress import finish  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.source import read_net_offset  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types  # noqa: PLC0415

    if b"netOffset" in content:
        require_physical(read_net_offset(path), most=1e8)
    else:
        require_physical(finish(read_vehicle_types([path])), most=100.0)


# --- Blender's files and detectors


def _blends(folder: Path) -> list[bytes]:
    import headless.runtime  # noqa: F401, PLC0415  # names the system libraries that bpy needs

    import bpy  # noqa: PLC0415

    from seip_addon.scene.blend_file import new_file, save_blend  # noqa: PLC0415

    new_file()
    mesh = bpy.data.meshes.new("square")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    for name in ("SEIP Roads", "SEIP Region"):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(bpy.data.objects.new(name, mesh))
    save_blend(folder / "sample.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "plain.blend"), copy=True, compress=False)
    packed = [folder / "sample.blend", ROOT / "scenes" / "junction.blend"]
    return [path.read_bytes() for path in (*packed, folder / "plain.blend")]


def _mutate_blend(random: Random, content: bytes) -> Case:
    """Mostly other values in bytes that stay where they are: Blender itself sees what is put in or taken out."""
    if random.random() < 0.3:
        return Case(mutated_bytes(random, content))
    data = np.frombuffer(content, dtype=np.uint8).copy()
    where = random.integers(len(data), size=int(2 ** random.uniform(0, 8)))
    data[where] = random.integers(256, size=len(where))
    return Case(data.tobytes())


def _read_blend(path: Path, _: bytes) -> None:
    import headless.runtime  # noqa: F401, PLC0415

    import bpy  # noqa: PLC0415

    from seip_addon.scene.blend_file import open_blend  # noqa: PLC0415
    from seip_addon.scene.read import read_scene  # noqa: PLC0415

    open_blend(path)
    geometry = read_scene(bpy.context.scene).geometry
    require_physical([part.triangles for part in geometry.roads], "road")


def _detectors(folder: Path) -> list[bytes]:
    from headless.detection.detector import Detector, TrainingRecord  # noqa: PLC0415
    from headless.detection.settings import NetworkSettings  # noqa: PLC0415

    network = NetworkSettings(width=8, blocks=(0, 0, 0), most_points=2)
    Detector(network, seed=1, training_record=TrainingRecord(("type1",), ("Junction",))).save(folder / "sample.pt")
    return [(folder / "sample.pt").read_bytes()]


def _mutate_detector(random: Random, content: bytes) -> Case:
    import torch  # noqa: PLC0415

    if random.random() < 0.5:
        return Case(mutated_bytes(random, content))
    state = torch.load(io.BytesIO(content), weights_only=True)
    if random.random() < 0.7:
        del state["digest"]
        state["version"] = 1
    values = (None, -5, 1e300, "x", float("nan"), [], {}, torch.full((2,), float("nan")))
    value = values[int(random.integers(len(values)))]
    table = ("settings", "weights", "experience", None)[int(random.integers(4))]
    inner = state if table is None else state[table]
    names = [name for name in inner if name not in {"version", "digest"}]
    name = names[int(random.integers(len(names)))]
    inner[name] = value
    file = io.BytesIO()
    torch.save(state, file)
    empty = isinstance(value, list | dict) and table in {"experience", None}
    harmless = empty or (isinstance(value, int) and name in {"west", "south", "bottom"})
    return Case(file.getvalue(), contradicts=not harmless)


def _read_detector(path: Path, _: bytes) -> None:
    from headless.detection.detector import Detector  # noqa: PLC0415

    Detector.load(path)


# --- records of placements, and the arrays beside them


# --- elevation models and surveys


def _elevations(folder: Path) -> list[bytes]:
    from tests.builders.dem_files import origin_at, sampled, write_dem  # noqa: PLC0415

    x, y, _ = origin_at(52.5, 13.4)
    slope = sampled(lambda a, b: 30 + 0.01 * (a - x), x - 100, y + 100, 40, 5.0)
    degrees = np.full((20, 20), 31.0, dtype=np.float32)
    return [
        write_dem(folder / "sample.tif", slope, x - 100, y + 100, 5.0).read_bytes(),
        write_dem(folder / "sample.tif", degrees, 13.39, 52.51, 0.001, 4326, no_data=-9999).read_bytes(),
    ]


def _mutate_elevation(random: Random, content: bytes) -> Case:
    """Mostly other values in the tags, which are at the beginning or the end."""
    if random.random() < 0.3:
        return Case(mutated_bytes(random, content))
    data = np.frombuffer(content, dtype=np.uint8).copy()
    tags = len(data) - 600 if random.random() < 0.5 else 0
    where = tags + random.integers(600, size=int(2 ** random.uniform(0, 4)))
    data[np.clip(where, 0, len(data) - 1)] = random.integers(256, size=len(where))
    return Case(data.tobytes())


def _read_elevation(path: Path, _: bytes) -> None:
    from seip_addon.core.world.elevation.geotiff import read_geotiff  # noqa: PLC0415

    model = read_geotiff(path)
    require_physical(model, most=1e8)
    at = model.at(np.array([[model.corner[0], model.corner[1]], [0.0, 0.0], [1e9, 1e9]]))
    require_physical({"heights": at}, "looked up", most=9000.0)
    require_physical(model.middle, "middle", most=1e8)


def _surveys(suffix: str) -> Callable[[Path], list[bytes]]:
    def samples(folder: Path) -> list[bytes]:
        from tests.builders.dem_files import origin_at  # noqa: PLC0415
        from tests.builders.survey_files import block_points, ground_points, write_survey  # noqa: PLC0415

        random = np.random.default_rng(0)
        x, y, _ = origin_at(52.5, 13.4)
        parts = [ground_points(random, lambda a, b: 30 + 0 * a, 5.0), block_points(random, 0, 0, 3, 3, 38.0)]
        wkt = 'PROJCS["UTM 33N",AUTHORITY["EPSG","25833"]]'
        path = write_survey(folder / f"sample{suffix}", np.concatenate(parts), (x, y), wkt)
        return [path.read_bytes()]

    return samples


def _mutate_survey(random: Random, content: bytes) -> Case:
    """Mostly other values in the header and the records that follow it."""
    if random.random() < 0.3:
        return Case(mutated_bytes(random, content))
    data = np.frombuffer(content, dtype=np.uint8).copy()
    if random.random() < 0.4:  # number of records, sizes and counts
        begin = (94, 96, 100, 105, 107, 131, 155, 179, 235, 243, 247)[int(random.integers(11))]
        data[begin : begin + 4] = random.integers(256, size=4)
        return Case(data.tobytes())
    where = random.integers(500, size=int(2 ** random.uniform(0, 4)))
    data[where] = random.integers(256, size=len(where))
    return Case(data.tobytes())


def _read_survey(path: Path, _: bytes) -> None:
    from seip_addon.core.progress import finish  # noqa: PLC0415
    from seip_addon.core.world.elevation.point_cloud import read_points, survey_system  # noqa: PLC0415

    require_physical(survey_system(path)[1], "middle", most=1e8)
    require_physical(finish(read_points(path, np.full(2, -1e8), np.full(2, 1e8))), most=1e8)


# --- extracts, networks and routes


def _extracts(_: Path) -> list[bytes]:
    return [(ROOT / "scenes" / "harbour.osm").read_bytes()]


def _pbf_extracts(folder: Path) -> list[bytes]:
    import osmium  # noqa: PLC0415

    contents = []
    for options in ("pbf", "pbf,pbf_compression=none"):
        path = folder / "sample.osm.pbf"
        with osmium.SimpleWriter(osmium.io.File(str(path), options), overwrite=True) as writer:
            for element in osmium.FileProcessor(str(ROOT / "scenes" / "harbour.osm")):
                writer.add(element)
        contents.append(path.read_bytes())
    return contents


def _mutate_pbf(random: Random, content: bytes) -> Case:
    return Case(mutated_bytes(random, content))


def _mutate_extract(random: Random, content: bytes) -> Case:
    if random.random() < 0.5:
        pattern = r'(?:k="(?:height|width|lanes|building:levels|min_height|maxspeed|layer)" v|lat|lon)="([^"]*)"'
        return Case(_changed(random, content.decode(), pattern, (*NUMBERS, "3;4", "40'", "1e400 m", "-2 m")))
    return Case(mutated_text(random, content))


def _read_extract(path: Path, _: bytes) -> None:
    from seip_addon.core.progress import finish  # noqa: PLC0415
    from seip_addon.core.world.openstreetmap.extract import read_extract  # noqa: PLC0415
    from seip_addon.core.world.openstreetmap.quantities import count, metres  # noqa: PLC0415

    extract = finish(read_extract(path))
    require_physical([[node.latitude, node.longitude] for node in extract.nodes.values()], "nodes", most=540.0)
    for way in extract.ways.values():
        for value in way.tags.values():
            require_physical([metres(value, 900.0) or 0.0, count(value, 200.0) or 0.0], "a length", most=900.0)


_NETWORK = b"""<net version="1.20" junctionCornerDetail="5">
 <location netOffset="0.00,0.00" convBoundary="-100,-100,100,100"/>
 <edge id=":1_0" function="internal"><lane id=":1_0_0" index="0" speed="9" length="9.5" shape="0,0 9,3"/></edge>
 <edge id="a" from="0" to="1"><lane id="a_0" index="0" allow="pedestrian" speed="1" length="90.25" shape="-99,5 -9,5"/>
  <lane id="a_1" index="1" disallow="pedestrian" speed="13.9" length="90.25" shape="-99,2 -9,2"/></edge>
 <edge id="b" from="1" to="2"><lane id="b_0" index="0" speed="13.9" length="80.5" shape="9,2 50,2,1 89,2"/></edge>
 <junction id="1" type="traffic_light" x="0.00" y="0.00" incLanes="a_1" shape="0,0 1,1 0,2"/>
 <connection from="a" to="b" fromLane="1" toLane="0" via=":1_0_0" dir="s" state="O"/>
</net>"""


def _networks(_: Path) -> list[bytes]:
    return [_NETWORK]


_mutate_network = _with_wrong_values(0.4, r'<edge id="[ab]".*?(?:length="([^"]*)")', (*NOT_FINITE, "-7", "1e300"))


def _read_network(path: Path, _: bytes) -> None:
    from seip_addon.core.world.traffic_simulation.street_network import read_network  # noqa: PLC0415

    network = read_network(path)
    require_physical([edge.lanes for edge in network.edges.values()], "lanes", most=1e8)
    require_physical(network.signalised, "junctions", most=1e8)
    assert all(lane.length >= 0.0 for edge in network.edges.values() for lane in edge.lanes), "a negative length"
    _ = network.arms


def _flows(_: Path) -> list[bytes]:
    text = (
        b'<routes><vType id="t" vClass="passenger" length="4.5"/><route id="r" edges="a b"/>'
        b'<flow id="f" type="t" route="r" begin="0" vehsPerHour="300"/>'
        b'<flow id="g" begin="0" period="exp(0.1)"><route edges="a b"/></flow></routes>'
    )
    return [text]


_mutate_flow = _with_wrong_values(0.2, r'vehsPerHour="([^"]*)"', (*NOT_FINITE, "-7", "1e300", "0"))


def _read_flow(path: Path, _: bytes) -> None:
    from headless.studies.paper.route_file import read_demand, write_run  # noqa: PLC0415

    from seip_addon.core.progress import finish  # noqa: PLC0415

    demand = finish(read_demand(path))
    require_physical(demand, most=1e6)
    write_run(path.with_suffix(".out.xml"), demand, 1, 60.0)


def _costs(_: Path) -> list[bytes]:
    from seip_addon.core.site.installed_cost import DEFAULTS  # noqa: PLC0415

    return [DEFAULTS.read_bytes()]


def _read_costs(path: Path, _: bytes) -> None:
    from seip_addon.core.site.installed_cost import load_installed_cost  # noqa: PLC0415

    require_physical(load_installed_cost(path), most=1e9)


# --- recordings of sensors


def _sweeps(suffix: str) -> Callable[[Path], list[bytes]]:
    def samples(folder: Path) -> list[bytes]:
        from tests.builders.recording_files import make_points, pcd_text, write_sweep_file  # noqa: PLC0415

        columns = make_points(count=60)
        if suffix == ".pcd":
            return [pcd_text(columns, data, "1 2 3 0 0 0 1") for data in ("ascii", "binary", "binary_compressed")]
        return [write_sweep_file(folder / f"sample{suffix}", columns).read_bytes()]

    return samples


def _mutate_pcd(random: Random, content: bytes) -> Case:
    """Mutate the header, the points or both; or announce more points than there are."""
    head, data, body = content.partition(b"DATA ")
    if random.random() < 0.15:
        more = str(random.integers(61, 2**40)).encode()
        return Case(head.replace(b" 60\n", b" " + more + b"\n") + data + body, contradicts=True)
    if random.random() < 0.6:
        head = mutated_text(random, head)
    if random.random() < 0.6:
        body = mutated_bytes(random, body)
    return Case(head + data + body)


def _mutate_numbers(random: Random, content: bytes) -> Case:
    """Put a wrong number in place of one of 32 bits; otherwise any mutation."""
    if random.random() < 0.5:
        return Case(mutated_bytes(random, content))
    numbers = np.frombuffer(content, "<f4").copy()
    wrong = (np.nan, np.inf, -np.inf, 1e30, -1e30, 1e-40, 2e4, 0.5, -1.0)
    numbers[int(random.integers(len(numbers)))] = wrong[int(random.integers(len(wrong)))]
    return Case(numbers.tobytes())


def _mutate_npz(random: Random, content: bytes) -> Case:
    """Put other values, types and shapes in place of those of an array; otherwise any mutation."""
    if random.random() < 0.3:
        return Case(mutated_bytes(random, content))
    with np.load(io.BytesIO(content)) as stored:
        arrays = {name: stored[name] for name in stored.files}
    name = sorted(arrays)[int(random.integers(len(arrays)))]
    array = arrays[name]
    forms = (array[None], array[1:], array[:0], array.astype("U9"), array.astype("f8") * 1e300, array * 1j, array > 0)
    kind = int(random.integers(len(forms) + 2))
    arrays[name] = forms[kind] if kind < len(forms) else array.astype("f4") * np.float32(random.normal(0, 1e3))
    if kind > len(forms):
        arrays[name][int(random.integers(len(array)))] = np.nan
    file = io.BytesIO()
    np.savez(file, **arrays)
    return Case(file.getvalue())


def _read_sweep(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.sweep_files import read_sweep  # noqa: PLC0415

    sweep = read_sweep(path)
    require_physical(sweep.points, "points", most=10_000.0)
    require_physical(sweep, most=1e11)
    assert sweep.points.any(axis=1).all(), "a point that is no return"


def _sensor_poses(_: Path) -> list[bytes]:
    from seip_addon.core.output.datasets.kitti import CALIBRATION  # noqa: PLC0415

    rows = [[0.0, -1.0, 0.0, 12.5], [1.0, 0.0, 0.0, -3.25], [0.0, 0.0, 1.0, 6.0], [0.0, 0.0, 0.0, 1.0]]
    turned = {"rotation": [row[:3] for row in rows[:3]], "translation": [row[3:] for row in rows[:3]]}
    listed = {"sensors": [{"id": "S1", "pose": rows}, {"name": "S2", "pose": rows}]}
    block = "".join(f"S{number}:\n" + "".join(f"- {row}\n" for row in rows) for number in (1, 2))
    return [*(json.dumps(one).encode() for one in ({"S1": rows}, turned, listed)), block.encode(), CALIBRATION.encode()]


def _read_poses(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.poses import read_poses  # noqa: PLC0415

    poses = read_poses(path)
    require_physical(poses, "poses", most=1e7)
    for pose in poses.values():
        assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), rtol=0.0, atol=1e-9), "no rotation"
        assert np.linalg.det(pose[:3, :3]) > 0, "mirrored"


def _box_labels(_: Path) -> list[bytes]:
    from seip_addon.core.output.datasets.detection_files import kitti_results, openpcdet_results  # noqa: PLC0415
    from tests.builders.recording_files import dair_text, openlabel_text  # noqa: PLC0415

    kinds = ["car", "bus", "pedestrian"]
    boxes = np.array(
        [[10.0, -5.0, 0.8, 4.5, 1.8, 1.6, 0.3], [30, 4, 1.5, 12, 2.5, 3, -2], [7, 7, 0.9, 0.6, 0.7, 1.8, 1]]
    )
    text = (openlabel_text(boxes.tolist(), kinds), dair_text(boxes.tolist(), kinds))
    lines = [results(boxes, kinds, np.ones(3)) for results in (kitti_results, openpcdet_results)]
    return [one.encode() for one in (*text, *lines)]


def _read_box_labels(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.box_labels import read_labels  # noqa: PLC0415

    require_physical(read_labels(path), "labels", most=10_000.0)


FORMATS = {
    "map": Format((".xodr",), _maps, _mutate_map, _read_map),
    "site": Format((".toml",), _descriptions, _mutate_description, _read_description),
    "catalogue": Format((".toml",), _catalogues, _mutate_catalogue, _read_catalogue),
    "measurements": Format((".json",), _measurements, _mutate_text, _read_measurements),
    "fcd": Format((".xml",), _floating_car_data, _mutate_floating_car_data, _read_floating_car_data),
    "routes": Format((".xml",), _routes, _mutate_routes, _read_routes),
    "cost": Format((".toml",), _costs, _mutate_text, _read_costs),
    "network": Format((".xml",), _networks, _mutate_network, _read_network),
    "flows": Format((".xml",), _flows, _mutate_flow, _read_flow),
    "osm": Format((".osm",), _extracts, _mutate_extract, _read_extract),
    "osm.pbf": Format((".osm.pbf",), _pbf_extracts, _mutate_pbf, _read_extract),
    "dem": Format((".tif",), _elevations, _mutate_elevation, _read_elevation),
    **{
        f"survey{suffix}": Format((suffix,), _surveys(suffix), _mutate_survey, _read_survey)
        for suffix in (".las", ".laz")
    },
    "sweep.pcd": Format((".pcd",), _sweeps(".pcd"), _mutate_pcd, _read_sweep),
    "sweep.bin": Format((".bin",), _sweeps(".bin"), _mutate_numbers, _read_sweep),
    "sweep.pcd.bin": Format((".pcd.bin",), _sweeps(".pcd.bin"), _mutate_numbers, _read_sweep),
    "sweep.npz": Format((".npz",), _sweeps(".npz"), _mutate_npz, _read_sweep),
    "poses": Format((".json",), _sensor_poses, _mutate_text, _read_poses),
    "boxes": Format((".json",), _box_labels, _mutate_text, _read_box_labels),
    "blend": Format((".blend",), _blends, _mutate_blend, _read_blend),
    "pt": Format((".pt",), _detectors, _mutate_detector, _read_detector),
}


def is_fault(key: str, line: str) -> bool:
    """Return whether an outcome is a fault of this project: Blender's own reader falls over some damaged files.

    It ends by a segmentation fault (11) or aborts on memory that it has damaged (6), within ``wm.open_mainfile``.
    """
    of_blender = key == "blend" and line.startswith(("crash: status -11", "crash: status -6"))
    return line not in {"result", "refused"} and not of_blender


def _sentence(text: str) -> None:
    assert text, "an error without a word"
    assert len(text) < 1500, f"a sentence of {len(text)} characters"


def case_of(key: str, samples: list[bytes], seed: int, number: int) -> Case:
    """Return an input: the same for the same format, seed and number."""
    random = np.random.default_rng([seed, number, *key.encode()])
    return FORMATS[key].mutate(random, samples[int(random.integers(len(samples)))])


def outcome(key: str, case: Case, folder: Path) -> str:
    """Read an input; return ``result``, ``refused``, or what is at fault, in one line."""
    from seip_addon.core.errors import SeipError  # noqa: PLC0415

    path = folder / f"input{FORMATS[key].suffixes[0]}"
    path.write_bytes(case.content)
    try:
        FORMATS[key].read(path, case.content)
    except SeipError as error:
        try:
            _sentence(str(error))
        except AssertionError as fault:
            return f"sentence: {fault}"
        return "refused"
    except BaseException as error:  # noqa: BLE001  # whatever it is, it is what is looked for
        where = traceback.extract_tb(error.__traceback__)[-1]
        what = str(error).replace("\n", " ")[:160]
        return f"traceback: {type(error).__name__} in {Path(where.filename).name}:{where.lineno}: {what}"
    return "accepted: a file that contradicts itself" if case.contradicts else "result"


def _work(key: str, seed: int, begin: int, count: int) -> None:
    """Read inputs in this process, and say of each how it went; readers' own words go elsewhere."""
    import os  # noqa: PLC0415

    said = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        samples = FORMATS[key].samples(Path(folder))
        said.write("ready\n")
        for number in range(begin, begin + count):
            said.write(f"{number} {outcome(key, case_of(key, samples, seed, number), Path(folder))}\n")
    os._exit(0)


def fuzz(key: str, seed: int, count: int) -> list[str]:
    """Return how each of some inputs of a format went."""
    went: list[str] = []
    limit = SECONDS if FORMATS[key].share == 1.0 else SLOW_SECONDS
    while len(went) < count:
        command = [
            sys.executable,
            "-m",
            "tests.fuzz",
            key,
            "--worker",
            str(len(went)),
            "--count",
            str(count - len(went)),
        ]
        process = subprocess.Popen(  # noqa: S603  # this file
            [*command, "--seed", str(seed)],
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
        )
        assert process.stdout is not None
        ready = False
        while True:
            waited, _, _ = select.select([process.stdout], [], [], limit)
            line = process.stdout.readline() if waited else ""
            if not line:
                break
            if ready:
                went.append(line.rstrip("\n").partition(" ")[2])
            ready = True
        process.kill()
        status = process.wait()
        process.stdout.close()
        if not ready:
            raise RuntimeError(f"the reader of {key} does not start: status {status}")
        if len(went) < count:
            went.append(f"hang: after {limit:g} s" if not waited else f"crash: status {status}")
    return went


def main(arguments: list[str]) -> int:
    """Run the formats asked for and print counts."""
    parser = argparse.ArgumentParser(prog="fuzz", description="Read hostile files of each format.")
    parser.add_argument("formats", nargs="*", choices=[*FORMATS, []], help="which (all)")
    parser.add_argument("--count", type=int, default=300, help="inputs of each format (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of all that is random (%(default)s)")
    parser.add_argument(
        "--minutes", type=float, default=0.0, help="go on with the next seeds for so long (%(default)s: one round)"
    )
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder for inputs that were at fault")
    parser.add_argument("--worker", type=int, metavar="BEGIN", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.worker is not None:
        _work(options.formats[0], options.seed, options.worker, options.count)
    faults, seed, end = 0, options.seed, time.monotonic() + 60.0 * options.minutes
    while True:
        faults += _round(options, seed)
        seed += 1
        if time.monotonic() >= end:
            return 1 if faults else 0


def _round(options: argparse.Namespace, seed: int) -> int:
    """Fuzz all formats asked for with one seed, print counts, and return the number of faults."""
    faults = 0
    for key in options.formats or FORMATS:
        count = max(1, round(options.count * FORMATS[key].share))
        went = fuzz(key, seed, count)
        counts = Counter(line.partition(":")[0] for line in went)
        wrong = {number: line for number, line in enumerate(went) if line not in {"result", "refused"}}
        lines = [
            f"seed {seed}, {key}: {count} inputs, {', '.join(f'{counts[kind]} {kind}' for kind in sorted(counts))}"
        ]
        for line, number in Counter(wrong.values()).most_common(20):
            lines.append(f"  {number} × {line}, first input {next(n for n, other in wrong.items() if other == line)}")
        sys.stdout.write("\n".join([*lines, ""]))
        faults += sum(is_fault(key, line) for line in wrong.values())
        if options.keep is not None:
            _keep(key, seed, list(wrong), options.keep)
        sys.stdout.flush()
    return faults


def _keep(key: str, seed: int, numbers: list[int], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        samples = FORMATS[key].samples(Path(scratch))
    for number in numbers:
        content = case_of(key, samples, seed, number).content
        (folder / f"{key}-{seed}-{number}{FORMATS[key].suffixes[0]}").write_bytes(content)


if __name__ == "__main__":
    STATUS = main(sys.argv[1:])
    sys.stdout.flush()
    os._exit(STATUS)  # Blender's module, once loaded, may keep the process from ending
