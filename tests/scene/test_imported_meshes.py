"""Meshes of files in a scene: where they stand, that rays end on them, and what is refused."""

import math
import struct
import sys

from headless import build_scene

import bpy
import numpy as np
import pytest

from seip_addon.core.child_process import exit_status
from seip_addon.core.errors import SeipError
from seip_addon.scene import contract, imported
from seip_addon.scene.read import read_scene
from tests.builders.city_text import origin_at
from tests.few import few

X, Y, _ = origin_at(52.5, 13.4)
CORNERS = [(x, y, z) for z in (0, 6) for x, y in ((0, 0), (10, 0), (10, 4), (0, 4))]
FACES = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
MAP = f"""<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="6" name="street">
<geoReference><![CDATA[+proj=utm +zone=33 +datum=WGS84 +units=m]]></geoReference>
<offset x="{X}" y="{Y}" z="0" hdg="0"/></header>
<road id="1" length="200" junction="-1"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="30" b="0" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


def obj_text(corners=CORNERS, faces=FACES):
    lines = ["v " + " ".join(map(str, corner)) for corner in corners]
    return "\n".join([*lines, *("f " + " ".join(str(i + 1) for i in face) for face in faces)]) + "\n"


def write_ply(path):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(CORNERS)}\n" + "".join(f"property float {c}\n" for c in "xyz")
    head += f"element face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, row)) for row in (*CORNERS, *((4, *face) for face in FACES))]
    path.write_text(head + "\n".join(rows) + "\n", encoding="utf-8")


def write_stl(path):
    triangles = [[CORNERS[i] for i in (f[0], f[a], f[a + 1])] for f in FACES for a in (1, 2)]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(each), 0) for each in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + body)


def write_by_blender(path):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    mesh = bpy.data.meshes.new("box")
    mesh.from_pydata(CORNERS, [], FACES)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("box", mesh))
    if path.suffix == ".glb":
        bpy.ops.export_scene.gltf(filepath=str(path))
    else:
        bpy.ops.wm.usd_export(filepath=str(path))


def built(tmp_path, *arguments):
    (tmp_path / "map.xodr").write_text(MAP, encoding="utf-8")
    output = tmp_path / "site.blend"
    place = [str(tmp_path / "map.xodr"), "--near", "100", "0", "--radius", "40", "-o", str(output)]
    build_scene.main([*place, *map(str, arguments)])
    bpy.ops.wm.open_mainfile(filepath=str(output))
    geometry = read_scene(bpy.context.scene).geometry
    (mesh,) = [one for one in geometry.occluders if one.name.startswith("box")]
    return mesh.triangles.reshape(-1, 3) + geometry.origin


@pytest.mark.parametrize("kind", few([".obj", ".glb", ".ply", ".stl", ".usdc"], 2))
def test_a_box_stands_where_it_is_put(kind, tmp_path):
    path = tmp_path / f"box{kind}"
    writers = {".obj": lambda path: path.write_text(obj_text(), encoding="utf-8"), ".ply": write_ply, ".stl": write_stl}
    writers.get(kind, write_by_blender)(path)
    up = ["--mesh-up", "z"] if kind == ".obj" else []
    corners = built(tmp_path, "--mesh", path, "--mesh-origin", 90, 12, 90, *up)
    assert corners.min(axis=0) == pytest.approx([86, 12, 30], abs=0.04)  # the ground lies a little below the road
    assert corners.max(axis=0) == pytest.approx([90, 22, 36], abs=0.04)
    assert [obj[contract.SOURCE] for obj in bpy.data.objects if obj.name.startswith("box")] == ["mesh file"]


def test_a_place_in_degrees_is_that_of_the_map(tmp_path):
    path = tmp_path / "box.obj"
    path.write_text(obj_text(), encoding="utf-8")
    metre = math.degrees(1 / 6_371_000)
    east = 100 * metre / math.cos(math.radians(52.5))
    corners = built(tmp_path, "--mesh", path, "--mesh-origin", 52.5 + 15 * metre, 13.4 + east, "--mesh-up", "z")
    assert corners[:, :2].min(axis=0) == pytest.approx([100, 15], abs=2.5)  # UTM north is not true north


def test_the_provenance_names_the_mesh(tmp_path, capsys):
    path = tmp_path / "box.obj"
    path.write_text(obj_text(), encoding="utf-8")
    built(tmp_path, "--mesh", path, "--mesh-origin", 90, 12)
    assert "mesh file" in capsys.readouterr().out


HUGE = [(x * 1e5, y, z) for x, y, z in CORNERS]
FLAT = [(x, 0, 0) for x, _, _ in CORNERS]


@pytest.mark.parametrize(("name", "text", "origin", "complaint"), [
    ("box.obj", obj_text(FLAT), (90, 12), "only faces of zero area"),
    ("box.obj", obj_text(HUGE), (90, 12), "1,000,000 m from its zero"),
    ("box.obj", obj_text(faces=[]), (90, 12), "holds no face"),
    ("box.ply", "ply\nnothing", (90, 12), "box.ply"),
    ("box.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 2147483648\nproperty float x\nend_header\n",
     (90, 12), "announces 2,147,483,648 rows of 'vertex' and has 0 bytes"),
    ("box.gltf", '{"asset": {"version": "2.0"}, "buffers": [{"uri": "../../etc/passwd", "byteLength": 9}]}',
     (90, 12), "which is not in the folder of the model"),
    ("box.glb", "nothing", (90, 12), "box.glb does not begin as a binary glTF"),
    ("box.dxf", "nothing", (90, 12), "of no kind that is imported"),
    ("box.obj", obj_text(), (90_000, 12), "90000, 12 is not within 2,000 m of the site"),
    ("box.obj", obj_text(), (90, float("nan")), "--mesh-origin must be a finite number"),
    ("box.obj", obj_text(), (90, 2, 3, 4), "the origin of box.obj must be"),
    ("box.obj", obj_text(), None, "each --mesh its own --mesh-origin"),
    ("box.obj", None, (90, 12), "no such file"),
])  # fmt: skip
def test_a_faulty_mesh_leaves_no_file(name, text, origin, complaint, tmp_path):
    path = tmp_path / name
    if text is not None:
        path.write_text(text, encoding="utf-8")
    given = [] if origin is None else ["--mesh-origin", *origin]
    with pytest.raises(SeipError, match=complaint):
        built(tmp_path, "--mesh", path, *given)
    assert not (tmp_path / "site.blend").exists()


@pytest.mark.parametrize(
    ("status", "complaint"),
    [(-11, "Blender crashes when it imports box.obj"), (None, "takes more than 300 s to import box.obj")],
)
def test_an_import_that_crashes_or_hangs_ends_in_a_sentence(tmp_path, monkeypatch, status, complaint):
    path = tmp_path / "box.obj"
    path.write_text(obj_text(), encoding="utf-8")
    monkeypatch.setattr(imported, "exit_status", lambda *_: status)
    with pytest.raises(SeipError, match=complaint):
        built(tmp_path, "--mesh", path, "--mesh-origin", 90, 12)
    assert not (tmp_path / "site.blend").exists()


def test_a_program_that_takes_too_long_is_ended():
    assert exit_status([sys.executable, "-c", "import time; time.sleep(60)"], 0.2) is None
    assert exit_status([sys.executable, "-c", "import sys; sys.exit(3)"], 60.0) == 3


def test_faces_of_vertices_that_are_not_there_are_left_out(tmp_path):
    corners = ", ".join(str(corner) for corner in CORNERS)
    path = tmp_path / "box.usda"
    path.write_text(
        f"""#usda 1.0
(metersPerUnit = 1
upAxis = "Z")
def Mesh "box" {{
    int[] faceVertexCounts = [4, 4, 3]
    int[] faceVertexIndices = [0, 1, 5, 4, 4, 5, 6, 7, 0, 1, 90000000]
    point3f[] points = [{corners}]
}}
""",
        encoding="utf-8",
    )
    corners = built(tmp_path, "--mesh", path, "--mesh-origin", 90, 12)
    assert len(np.unique(corners, axis=0)) == 6
