"""Checks of the headers of mesh files, because Blender's importers trust them.

An importer allocates memory for the counts in a header and opens the files that a model names. Here these counts are
compared with the size of the file, and named files must lie in the folder of the model. Formats: PLY (Turk 1994), STL,
glTF 2.0 (Khronos, sections 3.6 and 4.4) and OBJ.
"""

from __future__ import annotations

import base64
import binascii
import json
import mmap
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote, urlsplit

from ...errors import SeipError

MAX_ELEMENTS = 40_000_000  # vertices, faces or numbers of one kind that a header may announce
_MAX_HEADER = 1 << 16  # bytes of a PLY header
_MAX_JSON = 1 << 28  # bytes of the JSON of a glTF model
_PLY_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), "b"),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), "h"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
"""Types of PLY by the letters of `struct`; counts of lists are read without their sign."""
_STL_HEADER, _STL_TRIANGLE = 84, 50  # bytes
_COMPONENTS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
"""Bytes of the component types of glTF."""
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_GLB_JSON, _GLB_BINARY = 0x4E4F534A, 0x004E4942
_MATERIAL_FILE = re.compile(rb"^[ \t]*mtllib[ \t]+([^\r\n]+)", re.MULTILINE)


class _HeaderError(ValueError):
    """Fault of a file, as part of a sentence."""


def check_mesh_header(path: Path) -> None:
    """Check the counts in the header of a mesh file, and the files that it names.

    Parameters
    ----------
    path : Path
        Mesh file; formats other than PLY, STL, glTF and OBJ are not checked.

    Raises
    ------
    SeipError
        The file is shorter than its header announces, announces too much, is damaged, or names a file outside its
        folder.
    """
    check = _CHECKS.get(path.suffix.lower())
    if check is None:
        return
    try:
        check(path)
    except _HeaderError as error:
        raise SeipError(f"{path.name} {error}; write the file again") from error
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror or error}; check that it is a readable file") from error


# --- PLY


@dataclass(frozen=True)
class _PlyElement:
    """An element of a PLY file: its name, number of rows, and properties as (letter of the count or "", letter)."""

    name: str
    count: int
    properties: list[tuple[str, str]]


def _check_ply(path: Path) -> None:
    size = path.stat().st_size
    with path.open("rb") as file:
        begin = file.read(_MAX_HEADER)
    end = re.search(rb"(?:\A|\n)end_header[ \t]*\r?\n", begin)
    if not begin.startswith(b"ply") or end is None:
        raise _HeaderError("does not begin with the header of a PLY file")
    binary, elements = _ply_elements(begin[: end.start()].decode("ascii", "replace").splitlines()[1:])
    at = end.end()
    for element in elements:
        least = [struct.calcsize(f"<{counted or kind}") if binary else 2 for counted, kind in element.properties]
        row = max(sum(least), 1)
        if element.count > MAX_ELEMENTS or at + element.count * row > size + 1:  # the last line may lack its end
            raise _HeaderError(
                f"announces {element.count:,} rows of {element.name[:40]!r} and has {size - at:,} bytes for them"
            )
        at += element.count * row
    if binary:
        _check_ply_lists(path, end.end(), binary, elements)


def _ply_elements(lines: Sequence[str]) -> tuple[str, list[_PlyElement]]:
    """Return the byte order of a binary PLY for `struct`, "" for text, and the elements of the header."""
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    order, elements = None, []
    for line in lines:
        match line.split():
            case ["format", name, _] if name in orders:
                order = orders[name]
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count, re.ASCII):
                elements.append(_PlyElement(name, int(count), []))
            case ["property", "list", counted, kind, _] if elements and {counted, kind} <= _PLY_BYTES.keys():
                if _PLY_BYTES[counted] in "fd":
                    raise _HeaderError(f"has a list that is counted by {counted}")
                elements[-1].properties.append((_PLY_BYTES[counted].upper(), _PLY_BYTES[kind]))
            case ["property", kind, _] if elements and kind in _PLY_BYTES:
                elements[-1].properties.append(("", _PLY_BYTES[kind]))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise _HeaderError(f"has a line in its header that is not PLY: {line.strip()[:40]!r}")
    if order is None:
        raise _HeaderError("has no format line for text or binary")
    return order, elements


def _check_ply_lists(path: Path, at: int, order: str, elements: Sequence[_PlyElement]) -> None:
    """Check that all lists of a binary PLY file end within the file."""
    if not path.stat().st_size > at:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for element in elements:
            # Rows without lists have a fixed size and are skipped at once. Rows with lists must be read one by one,
            # because each list begins with its own length.
            if not any(counted for counted, _ in element.properties):
                at += element.count * struct.calcsize(f"<{''.join(kind for _, kind in element.properties)}")
                continue
            steps = [
                (struct.Struct(f"{order}{counted}") if counted else None, struct.calcsize(f"<{kind}"))
                for counted, kind in element.properties
            ]
            for row in range(element.count):
                for counter, width in steps:
                    if counter is None:
                        at += width
                    elif at + counter.size <= len(data):
                        at += counter.size + counter.unpack_from(data, at)[0] * width
                    else:
                        at = len(data) + 1
                if at > len(data):
                    raise _HeaderError(f"ends within row {row:,} of {element.count:,} of {element.name[:40]!r}")


# --- STL


def _check_stl(path: Path) -> None:
    size = path.stat().st_size
    with path.open("rb") as file:
        begin = file.read(_STL_HEADER)
    if len(begin) < _STL_HEADER:
        if not begin.lstrip().startswith(b"solid"):
            raise _HeaderError("is too short for an STL file")
        return
    (count,) = struct.unpack_from("<I", begin, 80)
    # Binary files may begin with "solid", too: the size tells both kinds apart.
    binary = size == _STL_HEADER + count * _STL_TRIANGLE
    if not binary and not begin.lstrip().startswith(b"solid"):
        raise _HeaderError(f"announces {count:,} triangles and has {size - _STL_HEADER:,} bytes for them")
    if binary and count > MAX_ELEMENTS:
        raise _HeaderError(f"holds {count:,} triangles, more than {MAX_ELEMENTS:,}")


# --- OBJ


def _check_obj(path: Path) -> None:
    if not path.stat().st_size:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for match in _MATERIAL_FILE.finditer(data):
            _require_inside(path, match[1].decode("utf-8", "replace").strip().replace("\\", "/"))


# --- glTF


def _check_gltf(path: Path) -> None:
    text, binary = _glb_parts(path) if path.suffix.lower() == ".glb" else (_limited(path), None)
    try:
        model = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _HeaderError(f"holds JSON that cannot be read ({str(error)[:80]})") from error
    if not isinstance(model, dict):
        raise _HeaderError("holds no glTF model")
    for image in _tables(model, "images"):
        if image.get("uri") is not None:
            _uri_bytes(path, image["uri"])
    buffers = [_buffer_size(path, buffer, binary, number) for number, buffer in enumerate(_tables(model, "buffers"))]
    views = [_view_size(view, buffers) for view in _tables(model, "bufferViews")]
    for accessor in _tables(model, "accessors"):
        _check_accessor(accessor, views)


def _limited(path: Path) -> bytes:
    if path.stat().st_size > _MAX_JSON:
        raise _HeaderError(f"has more than {_MAX_JSON >> 20} MiB of JSON: save it as .glb")
    return path.read_bytes()


def _glb_parts(path: Path) -> tuple[bytes, int]:
    """Return the JSON of a binary model, and the size of its buffer in bytes."""
    size = path.stat().st_size
    with path.open("rb") as file:
        header = file.read(20)
        if len(header) < 20 or not header.startswith(b"glTF"):
            raise _HeaderError("does not begin as a binary glTF file")
        version, length, chunk, kind = struct.unpack_from("<4I", header, 4)
        if version != 2 or length > size or kind != _GLB_JSON or not 20 + chunk <= length or chunk > _MAX_JSON:
            raise _HeaderError(f"announces {length:,} bytes with {chunk:,} of JSON and has {size:,}")
        text, rest = file.read(chunk), file.read(8)
    if len(rest) < 8 or 20 + chunk == length:
        return text, 0
    buffer, kind = struct.unpack("<2I", rest)
    if kind != _GLB_BINARY or 28 + chunk + buffer > length:
        raise _HeaderError(f"announces a buffer of {buffer:,} bytes and ends before it does")
    return text, buffer


def _tables(model: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    listed = model.get(name, [])
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise _HeaderError(f"holds {name} that are not a list of objects")
    return listed


def _number(table: Mapping[str, Any], name: str, default: int | None = None) -> int:
    value = table.get(name, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**40:
        raise _HeaderError(f"has {str(value)[:40]!r} for {name}, which is not a whole number from 0 on")
    return value


def _buffer_size(path: Path, buffer: Mapping[str, Any], binary: int | None, number: int) -> int:
    length, uri = _number(buffer, "byteLength"), buffer.get("uri")
    if uri is not None:
        there = _uri_bytes(path, uri)
    elif binary is not None and number == 0:
        there = binary
    elif "extensions" in buffer:  # such as a fallback of compressed views
        return length if length <= MAX_ELEMENTS else _refuse(length, 0)
    else:
        there = 0
    return length if length <= there else _refuse(length, there)


def _refuse(length: int, there: int) -> NoReturn:
    raise _HeaderError(f"announces a buffer of {length:,} bytes, of which there are {there:,}")


def _uri_bytes(path: Path, uri: object) -> int:
    """Return the number of bytes of a URI after checking that it is data or a file in the model's folder."""
    if not isinstance(uri, str):
        raise _HeaderError(f"has {str(uri)[:40]!r} in place of a URI")
    if uri.startswith("data:"):
        _, comma, content = uri.partition(",")
        try:
            return len(base64.b64decode(content)) if comma else _refuse(1, 0)
        except (binascii.Error, ValueError) as error:
            raise _HeaderError("has a data URI that is not base64") from error
    named = _require_inside(path, uri)
    return named.stat().st_size if named.is_file() else 0


def _require_inside(path: Path, uri: str) -> Path:
    """Return the path of a file that a model names after checking that it lies in the model's folder.

    Blender decodes percent-encoded names, so that both spellings must lie there.
    """
    folder = path.resolve().parent
    try:
        address = urlsplit(uri)
        named = [(folder / name).resolve() for name in (uri, unquote(uri))]
    except (ValueError, OSError, RuntimeError) as error:
        raise _HeaderError(f"names the file {uri[:80]!r}, which is not a file name") from error
    if address.scheme or address.netloc or not all(one.is_relative_to(folder) for one in named):
        raise _HeaderError(f"names the file {uri[:80]!r}, which is not in the folder of the model: put it there")
    return named[-1]


def _view_size(view: Mapping[str, Any], buffers: Sequence[int]) -> int:
    buffer, begin, length = _number(view, "buffer"), _number(view, "byteOffset", 0), _number(view, "byteLength")
    if buffer >= len(buffers) or begin + length > buffers[buffer]:
        raise _HeaderError(f"has a view of {length:,} bytes that reaches beyond its buffer")
    if not 0 <= _number(view, "byteStride", 4) <= 252:
        raise _HeaderError("has a view whose byteStride is not 4 to 252")
    return length


def _check_accessor(accessor: Mapping[str, Any], views: Sequence[int]) -> None:
    count, kind, component = _number(accessor, "count"), accessor.get("type"), accessor.get("componentType")
    if (
        not isinstance(kind, str)
        or kind not in _PARTS
        or not isinstance(component, int)
        or component not in _COMPONENTS
    ):
        raise _HeaderError(
            f"has an accessor of {str(kind)[:20]!r} of {str(component)[:20]!r}, which glTF does not have"
        )
    if count > MAX_ELEMENTS:
        raise _HeaderError(f"announces {count:,} elements, more than {MAX_ELEMENTS:,}")
    if "sparse" in accessor:
        sparse = accessor["sparse"]
        if not isinstance(sparse, dict) or _number(sparse, "count") > count:
            raise _HeaderError("has a sparse accessor with more values than elements")
    if "bufferView" in accessor:
        view, begin = _number(accessor, "bufferView"), _number(accessor, "byteOffset", 0)
        size = count * _PARTS[kind] * _COMPONENTS[component]
        if view >= len(views) or begin + size > views[view]:
            raise _HeaderError(f"announces {count:,} elements of {kind} beyond the end of their view")


_CHECKS: dict[str, Callable[[Path], None]] = {
    ".ply": _check_ply,
    ".stl": _check_stl,
    ".obj": _check_obj,
    ".gltf": _check_gltf,
    ".glb": _check_gltf,
}
