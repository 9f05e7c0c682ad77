"""Headers of mesh files: counts that the file does not hold and files outside the model's folder are refused."""

import base64
import json
import struct

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.world.streetscape.mesh_header import check_mesh_header

CORNERS = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], dtype="<f4")
BUFFER = CORNERS.tobytes() + np.array([0, 1, 2, 0, 2, 3], dtype="<u2").tobytes()


def ply(vertices="4", faces="1", form="ascii", rows=None, counted="uchar"):
    head = f"ply\nformat {form} 1.0\ncomment by hand\nelement vertex {vertices}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {faces}\nproperty list {counted} int vertex_indices\nend_header\n"
    if rows is None:
        rows = b"0 0 0\n4 0 0\n4 4 0\n0 4 0\n4 0 1 2 3\n"
        if form != "ascii":
            rows = CORNERS.tobytes() + struct.pack("<B4i", 4, 0, 1, 2, 3)
    return head.encode() + rows


def stl(count=2):
    return bytes(80) + struct.pack("<I", count) + bytes(100)


def gltf(**changes):
    model = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(BUFFER), "uri": data_uri(BUFFER)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
    }
    return json.dumps(model | changes).encode()


def data_uri(content):
    return f"data:application/octet-stream;base64,{base64.b64encode(content).decode()}"


def glb(text=None, length=None, buffer=None):
    text = (text or gltf(buffers=[{"byteLength": len(BUFFER)}])).ljust(1024)
    binary = struct.pack("<2I", len(BUFFER) if buffer is None else buffer, 0x004E4942) + BUFFER
    whole = 20 + len(text) + len(binary)
    return struct.pack("<4s4I", b"glTF", 2, whole if length is None else length, len(text), 0x4E4F534A) + text + binary


def checked(tmp_path, name, content):
    (tmp_path / "model").mkdir(exist_ok=True)
    path = tmp_path / "model" / name
    path.write_bytes(content)
    check_mesh_header(path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", ply()),
        ("a.ply", ply().rstrip(b"\n")),
        ("a.ply", ply(form="binary_little_endian")),
        ("a.stl", stl()),
        ("a.stl", b"solid box\nfacet normal 0 0 1\nendsolid\n"),
        ("a.gltf", gltf()),
        ("a.glb", glb()),
        ("a.obj", b"mtllib a.mtl\nv 0 0 0\nf 1 1 1\n"),
        ("a.obj", b""),
        ("a.usdc", b"anything"),
    ],
)
def test_a_sound_header_passes(tmp_path, name, content):
    checked(tmp_path, name, content)


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("a.ply", ply(vertices="2147483648"), "announces 2,147,483,648 rows of 'vertex' and has 34 bytes"),
        ("a.ply", ply(faces="1000"), "announces 1,000 rows of 'face'"),
        ("a.ply", ply(vertices="-4"), "not PLY: 'element vertex -4'"),
        ("a.ply", ply(counted="float"), "a list that is counted by float"),
        ("a.ply", ply(form="binary_little_endian")[:-1], "ends within row 0 of 1 of 'face'"),
        ("a.ply", ply(form="binary_little_endian", counted="uint"), "ends within row 0 of 1 of 'face'"),
        ("a.ply", b"ply\n" + b"comment x\n" * 20_000 + b"end_header\n", "header of a PLY file"),
        ("a.stl", stl(count=4_000_000_000), "announces 4,000,000,000 triangles and has 100 bytes"),
        ("a.stl", b"12", "too short"),
        (
            "a.gltf",
            gltf(buffers=[{"byteLength": 60, "uri": "../../etc/passwd"}]),
            "'../../etc/passwd', which is not in",
        ),
        ("a.gltf", gltf(buffers=[{"byteLength": 60, "uri": "%2e%2e/%2e%2e/etc/passwd"}]), "which is not in the folder"),
        ("a.gltf", gltf(buffers=[{"byteLength": 60, "uri": "file:///etc/passwd"}]), "which is not in the folder"),
        ("a.gltf", gltf(buffers=[{"byteLength": 60, "uri": "/etc/passwd"}]), "which is not in the folder"),
        ("a.gltf", gltf(images=[{"uri": "../picture.png"}]), "which is not in the folder"),
        ("a.gltf", gltf(buffers=[{"byteLength": 61, "uri": data_uri(BUFFER)}]), "announces a buffer of 61 bytes"),
        ("a.gltf", gltf(buffers=[{"byteLength": 2**31, "uri": "none.bin"}]), "announces a buffer of 2,147,483,648"),
        ("a.gltf", gltf(bufferViews=[{"buffer": 0, "byteLength": 70}]), "reaches beyond its buffer"),
        ("a.gltf", gltf(bufferViews=[{"buffer": 7, "byteLength": 1}]), "reaches beyond its buffer"),
        (
            "a.gltf",
            gltf(accessors=[{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}]),
            "5 elements of VEC3 beyond the end",
        ),
        ("a.gltf", gltf(accessors=[{"componentType": 5126, "count": 10**9, "type": "MAT4"}]), "1,000,000,000 elements"),
        ("a.gltf", gltf(accessors=[{"componentType": 5126, "count": -1, "type": "VEC3"}]), "'-1' for count"),
        ("a.gltf", b"[]", "holds no glTF model"),
        ("a.gltf", b"[" * 100_000, "JSON that cannot be read"),
        ("a.glb", glb(length=10**6), "announces 1,000,000 bytes"),
        ("a.glb", glb(buffer=10**6), "announces a buffer of 1,000,000 bytes"),
        ("a.obj", b"v 0 0 0\nmtllib ../../etc/passwd\n", "which is not in the folder of the model"),
    ],
)
def test_a_header_that_the_file_does_not_bear_out_is_refused(tmp_path, name, content, complaint):
    with pytest.raises(SeipError, match=complaint) as refusal:
        checked(tmp_path, name, content)
    assert str(refusal.value).startswith(f"{name} ")
    assert str(refusal.value).endswith("; write the file again")


def test_a_link_does_not_lead_out_of_the_folder(tmp_path):
    (tmp_path / "secret.bin").write_bytes(BUFFER)
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "inside.bin").symlink_to(tmp_path / "secret.bin")
    with pytest.raises(SeipError, match="not in the folder of the model"):
        checked(tmp_path, "a.gltf", gltf(buffers=[{"byteLength": 60, "uri": "inside.bin"}]))
