"""Hostile files of each format, seeded: a reader gives a result or a SeipError, and nothing else.

Numbers of a result are finite and within `core.base.limits`: an accepted file with any other number is a fault.

    python -m tests.fuzz --count 1000            # of each format
    python -m tests.fuzz map sweep.npz --count 5000 --seed 7

Inputs are read in a process of their own, so that one that hangs, crashes or fills the memory is counted and named
like the rest. Crashes within Blender's own reader are counted, and no fault of this project. Status 1 where there was
any.
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

MEMORY = 12 << 30
"""Bytes of address space that a reader may take."""

Random = np.random.Generator

NUMBERS = ("nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "0", "-0.0", "-1", "1e9", "-1e9", "99999999999999999999")
WORDS = ("", " ", "x", "\N{SNOWMAN}", "true", "driving", "../../etc/passwd", "a" * 5000, "%s%n", "\x7f", "0x10", "1_0")
PIECES = (b"\x00", b"\xff\xfe", b"<", b">", b"&", b'"', b"'", b"]]>", b"<!--", b"[", b"{", b"\n", b"\r", b";", b"=")


@dataclass(frozen=True)
class Format:
    """A format: the sound files that are mutated, how, and what reads them."""

    suffix: str
    samples: Callable[[Path], list[bytes]]
    mutate: Callable[[Random, bytes], bytes]
    read: Callable[[Path, bytes], None]


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


def _read_map(path: Path, _: bytes) -> None:
    from seip_addon.core.base.progress import finish  # noqa: PLC0415
    from seip_addon.core.world.opendrive.read import read_map  # noqa: PLC0415
    from seip_addon.core.world.streetscape.site_file import describe_place  # noqa: PLC0415
    from tests.builders.map_models import site_model  # noqa: PLC0415

    _, description = describe_place(path, near=(0.0, 0.0), radius=30.0)
    model = finish(site_model(read_map(path), description))
    for part in model.parts:
        require_physical([part.solid.vertices, part.foot, part.yaw], "model part", most=1e6)


def _descriptions(_: Path) -> list[bytes]:
    return [(ROOT / "scenes" / f"{name}.toml").read_bytes() for name in ("junction", "corridor")]


def _read_description(path: Path, _: bytes) -> None:
    from seip_addon.core.world.streetscape.site_file import read_site_description  # noqa: PLC0415

    require_physical(read_site_description(path))


def _catalogues(_: Path) -> list[bytes]:
    return [(ROOT / "seip_addon" / "core" / "sensing" / "lidar" / "catalogue.toml").read_bytes()]


def _read_catalogue(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.lidar.catalogue import load_catalogue  # noqa: PLC0415

    for model in load_catalogue([path]).values():
        require_physical(replace(model, price_range=model.price_range))


# --- SUMO's files


def _floating_car_data(_: Path) -> list[bytes]:
    from tests.builders.sumo_text import FCD  # noqa: PLC0415

    return [FCD.encode(), gzip.compress(FCD.encode(), mtime=0)]


def _mutate_floating_car_data(random: Random, content: bytes) -> bytes:
    return mutated_bytes(random, content) if content.startswith(b"\x1f") else mutated_text(random, content)


def _read_floating_car_data(path: Path, _: bytes) -> None:
    from seip_addon.core.base.progress import finish  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.floating_car_data import read_floating_car_data  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.trajectories import Trajectories  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.vehicle_types import BUILT_IN  # noqa: PLC0415

    got = finish(read_floating_car_data(path, BUILT_IN, np.zeros(3), "fuzz")).trajectories
    ground = replace(got, position=np.where(np.isnan(got.position), 0.0, got.position))
    require_physical(ground, most=1e11)
    ground.save(path.with_suffix(".npz"))
    assert Trajectories.load(path.with_suffix(".npz")).key == ground.key, "trajectories other than those written"


def _routes(_: Path) -> list[bytes]:
    from tests.builders.sumo_text import NET, ROUTES  # noqa: PLC0415

    return [ROUTES.encode(), NET.encode()]


def _read_routes(path: Path, content: bytes) -> None:
    from seip_addon.core.base.progress import finish  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.source import read_net_offset  # noqa: PLC0415
    from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types  # noqa: PLC0415

    if b"netOffset" in content:
        require_physical(read_net_offset(path), most=1e8)
    else:
        require_physical(finish(read_vehicle_types([path])), most=100.0)


# --- Blender's files


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


def _mutate_blend(random: Random, content: bytes) -> bytes:
    """Mostly other values in bytes that stay where they are: Blender itself sees what is put in or taken out."""
    if random.random() < 0.3:
        return mutated_bytes(random, content)
    data = np.frombuffer(content, dtype=np.uint8).copy()
    where = random.integers(len(data), size=int(2 ** random.uniform(0, 8)))
    data[where] = random.integers(256, size=len(where))
    return data.tobytes()


def _read_blend(path: Path, _: bytes) -> None:
    import headless.runtime  # noqa: F401, PLC0415

    import bpy  # noqa: PLC0415

    from seip_addon.scene.blend_file import open_blend  # noqa: PLC0415
    from seip_addon.scene.read import read_scene  # noqa: PLC0415

    open_blend(path)
    geometry = read_scene(bpy.context.scene).geometry
    require_physical([part.triangles for part in geometry.roads], "road")


# --- elevation models


def _elevations(folder: Path) -> list[bytes]:
    from tests.builders.dem_files import origin_at, sampled, write_dem  # noqa: PLC0415

    x, y, _ = origin_at(52.5, 13.4)
    slope = sampled(lambda a, b: 30 + 0.01 * (a - x), x - 100, y + 100, 40, 5.0)
    degrees = np.full((20, 20), 31.0, dtype=np.float32)
    return [
        write_dem(folder / "sample.tif", slope, x - 100, y + 100, 5.0).read_bytes(),
        write_dem(folder / "sample.tif", degrees, 13.39, 52.51, 0.001, 4326, no_data=-9999).read_bytes(),
    ]


def _mutate_elevation(random: Random, content: bytes) -> bytes:
    """Mostly other values in the tags, which are at the beginning or the end."""
    if random.random() < 0.3:
        return mutated_bytes(random, content)
    data = np.frombuffer(content, dtype=np.uint8).copy()
    tags = len(data) - 600 if random.random() < 0.5 else 0
    where = tags + random.integers(600, size=int(2 ** random.uniform(0, 4)))
    data[np.clip(where, 0, len(data) - 1)] = random.integers(256, size=len(where))
    return data.tobytes()


def _read_elevation(path: Path, _: bytes) -> None:
    from seip_addon.core.world.elevation.geotiff import read_geotiff  # noqa: PLC0415

    model = read_geotiff(path)
    require_physical(model, most=1e8)
    at = model.at(np.array([[model.corner[0], model.corner[1]], [0.0, 0.0], [1e9, 1e9]]))
    require_physical({"heights": at}, "looked up", most=9000.0)
    require_physical(model.middle, "middle", most=1e8)


# --- extracts and costs


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


def _mutate_extract(random: Random, content: bytes) -> bytes:
    if random.random() < 0.5:
        pattern = r'(?:k="(?:height|width|lanes|building:levels|min_height|maxspeed|layer)" v|lat|lon)="([^"]*)"'
        return _changed(random, content.decode(), pattern, (*NUMBERS, "3;4", "40'", "1e400 m", "-2 m"))
    return mutated_text(random, content)


def _read_extract(path: Path, _: bytes) -> None:
    from seip_addon.core.base.progress import finish  # noqa: PLC0415
    from seip_addon.core.world.openstreetmap.extract import read_extract  # noqa: PLC0415
    from seip_addon.core.world.openstreetmap.quantities import count, metres  # noqa: PLC0415

    extract = finish(read_extract(path))
    require_physical([[node.latitude, node.longitude] for node in extract.nodes.values()], "nodes", most=540.0)
    for way in extract.ways.values():
        for value in way.tags.values():
            require_physical([metres(value, 900.0) or 0.0, count(value, 200.0) or 0.0], "a length", most=900.0)


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
            return [pcd_text(columns, data, "1 2 3 0 0 0 1") for data in ("ascii", "binary")]
        return [write_sweep_file(folder / f"sample{suffix}", columns).read_bytes()]

    return samples


def _mutate_pcd(random: Random, content: bytes) -> bytes:
    """Mutate the header, the points or both."""
    head, data, body = content.partition(b"DATA ")
    if random.random() < 0.6:
        head = mutated_text(random, head)
    if random.random() < 0.6:
        body = mutated_bytes(random, body)
    return head + data + body


def _mutate_numbers(random: Random, content: bytes) -> bytes:
    """Put a wrong number in place of one of 32 bits; otherwise any mutation."""
    if random.random() < 0.5:
        return mutated_bytes(random, content)
    numbers = np.frombuffer(content, "<f4").copy()
    wrong = (np.nan, np.inf, -np.inf, 1e30, -1e30, 1e-40, 2e4, 0.5, -1.0)
    numbers[int(random.integers(len(numbers)))] = wrong[int(random.integers(len(wrong)))]
    return numbers.tobytes()


def _mutate_npz(random: Random, content: bytes) -> bytes:
    """Put other values, types and shapes in place of those of an array; otherwise any mutation."""
    if random.random() < 0.3:
        return mutated_bytes(random, content)
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
    return file.getvalue()


def _read_sweep(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.sweep_files import read_sweep  # noqa: PLC0415

    sweep = read_sweep(path)
    require_physical(sweep.points, "points", most=10_000.0)
    require_physical(sweep, most=1e11)
    assert sweep.points.any(axis=1).all(), "a point that is no return"


def _sensor_poses(_: Path) -> list[bytes]:
    rows = [[0.0, -1.0, 0.0, 12.5], [1.0, 0.0, 0.0, -3.25], [0.0, 0.0, 1.0, 6.0], [0.0, 0.0, 0.0, 1.0]]
    return [json.dumps(one).encode() for one in ({"S1": rows}, {"S1": rows, "S2": rows})]


def _read_poses(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.poses import read_poses  # noqa: PLC0415

    poses = read_poses(path)
    require_physical(poses, "poses", most=1e7)
    for pose in poses.values():
        assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), rtol=0.0, atol=1e-9), "no rotation"
        assert np.linalg.det(pose[:3, :3]) > 0, "mirrored"


def _box_labels(_: Path) -> list[bytes]:
    from seip_addon.core.output.datasets.formats import openpcdet_results  # noqa: PLC0415

    kinds = ["car", "bus", "pedestrian"]
    boxes = np.array(
        [[10.0, -5.0, 0.8, 4.5, 1.8, 1.6, 0.3], [30, 4, 1.5, 12, 2.5, 3, -2], [7, 7, 0.9, 0.6, 0.7, 1.8, 1]]
    )
    return [openpcdet_results(boxes, kinds, np.ones(3)).encode()]


def _read_box_labels(path: Path, _: bytes) -> None:
    from seip_addon.core.sensing.recordings.box_labels import read_labels  # noqa: PLC0415

    require_physical(read_labels(path), "labels", most=10_000.0)


FORMATS = {
    "map": Format(".xodr", _maps, mutated_text, _read_map),
    "site": Format(".toml", _descriptions, mutated_text, _read_description),
    "catalogue": Format(".toml", _catalogues, mutated_text, _read_catalogue),
    "fcd": Format(".xml", _floating_car_data, _mutate_floating_car_data, _read_floating_car_data),
    "routes": Format(".xml", _routes, mutated_text, _read_routes),
    "cost": Format(".toml", _costs, mutated_text, _read_costs),
    "osm": Format(".osm", _extracts, _mutate_extract, _read_extract),
    "osm.pbf": Format(".osm.pbf", _pbf_extracts, mutated_bytes, _read_extract),
    "dem": Format(".tif", _elevations, _mutate_elevation, _read_elevation),
    "sweep.pcd": Format(".pcd", _sweeps(".pcd"), _mutate_pcd, _read_sweep),
    "sweep.bin": Format(".bin", _sweeps(".bin"), _mutate_numbers, _read_sweep),
    "sweep.npz": Format(".npz", _sweeps(".npz"), _mutate_npz, _read_sweep),
    "poses": Format(".json", _sensor_poses, mutated_text, _read_poses),
    "boxes": Format(".txt", _box_labels, mutated_text, _read_box_labels),
    "blend": Format(".blend", _blends, _mutate_blend, _read_blend),
}


def is_fault(key: str, line: str) -> bool:
    """Return whether an outcome is a fault of this project: Blender's own reader falls over some damaged files.

    It ends by a segmentation fault (11) or aborts on memory that it has damaged (6), within ``wm.open_mainfile``.
    """
    of_blender = key == "blend" and line.startswith(("crash: status -11", "crash: status -6"))
    return line not in {"result", "refused"} and not of_blender


def input_of(key: str, samples: list[bytes], seed: int, number: int) -> bytes:
    """Return an input: the same for the same format, seed and number."""
    random = np.random.default_rng([seed, number, *key.encode()])
    return FORMATS[key].mutate(random, samples[int(random.integers(len(samples)))])


def outcome(key: str, content: bytes, folder: Path) -> str:
    """Read an input; return ``result``, ``refused``, or what is at fault, in one line."""
    from seip_addon.core.base.errors import SeipError  # noqa: PLC0415

    path = folder / f"input{FORMATS[key].suffix}"
    path.write_bytes(content)
    try:
        FORMATS[key].read(path, content)
    except SeipError as error:
        length = len(str(error))
        return "refused" if 0 < length < 1500 else f"sentence: of {length} characters"
    except BaseException as error:  # noqa: BLE001  # whatever it is, it is what is looked for
        where = traceback.extract_tb(error.__traceback__)[-1]
        what = str(error).replace("\n", " ")[:160]
        return f"traceback: {type(error).__name__} in {Path(where.filename).name}:{where.lineno}: {what}"
    return "result"


def _work(key: str, seed: int, begin: int, count: int) -> None:
    """Read inputs in this process, and say of each how it went; readers' own words go elsewhere."""
    said = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        samples = FORMATS[key].samples(Path(folder))
        said.write("ready\n")
        for number in range(begin, begin + count):
            said.write(f"{number} {outcome(key, input_of(key, samples, seed, number), Path(folder))}\n")
    os._exit(0)


def fuzz(key: str, seed: int, count: int) -> list[str]:
    """Return how each of some inputs of a format went."""
    went: list[str] = []
    while len(went) < count:
        asked = [key, "--worker", str(len(went)), "--count", str(count - len(went)), "--seed", str(seed)]
        process = subprocess.Popen(  # noqa: S603  # this file
            [sys.executable, "-m", "tests.fuzz", *asked],
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
            waited, _, _ = select.select([process.stdout], [], [], SECONDS)
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
            went.append(f"hang: after {SECONDS:g} s" if not waited else f"crash: status {status}")
    return went


def main(arguments: list[str]) -> int:
    """Run the formats asked for and print counts."""
    parser = argparse.ArgumentParser(prog="fuzz", description="Read hostile files of each format.")
    parser.add_argument("formats", nargs="*", choices=[*FORMATS, []], help="which (all)")
    parser.add_argument("--count", type=int, default=300, help="inputs of each format (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of all that is random (%(default)s)")
    parser.add_argument("--worker", type=int, metavar="BEGIN", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.worker is not None:
        _work(options.formats[0], options.seed, options.worker, options.count)
    faults = 0
    for key in options.formats or FORMATS:
        went = fuzz(key, options.seed, options.count)
        counts = Counter(line.partition(":")[0] for line in went)
        wrong = {number: line for number, line in enumerate(went) if line not in {"result", "refused"}}
        sys.stdout.write(f"{key}: {', '.join(f'{counts[kind]} {kind}' for kind in sorted(counts))}\n")
        sys.stdout.writelines(f"  input {number}: {line}\n" for number, line in wrong.items())
        sys.stdout.flush()
        faults += sum(is_fault(key, line) for line in wrong.values())
    return 1 if faults else 0


if __name__ == "__main__":
    STATUS = main(sys.argv[1:])
    sys.stdout.flush()
    os._exit(STATUS)  # Blender's module, once loaded, may keep the process from ending
