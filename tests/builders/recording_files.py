"""Files of real sensors, written by hand: sweeps, poses and labels."""

import numpy as np

PCD_TYPES = {"f": "F", "i": "I", "u": "U"}


def make_points(seed=0, count=200):
    """Columns x, y, z, intensity and ring of a sweep, of which x, y, z are float32."""
    random = np.random.default_rng(seed)
    xyz = random.uniform(-80, 80, (3, count)).astype("<f4")
    intensity = random.integers(0, 256, count).astype("<f4")
    return dict(zip(("x", "y", "z"), xyz, strict=True)) | {
        "intensity": intensity,
        "ring": np.sort(random.integers(0, 64, count)).astype("<u2"),
    }


def pcd_text(columns, data="binary", viewpoint="0 0 0 1 0 0 0", **changes):
    """Return a PCD file of columns (n,) or (n, several), by PCL's description of the format."""
    count = len(next(iter(columns.values())))
    parts = [np.asarray(column).reshape(count, *(column.shape[1:] or (1,))) for column in columns.values()]
    head = {
        "VERSION": "0.7",
        "FIELDS": " ".join(columns),
        "SIZE": " ".join(str(part.itemsize) for part in parts),
        "TYPE": " ".join(PCD_TYPES[part.dtype.kind] for part in parts),
        "COUNT": " ".join(str(part.shape[1]) for part in parts),
        "WIDTH": count,
        "HEIGHT": 1,
        "VIEWPOINT": viewpoint,
        "POINTS": count,
        "DATA": data,
    } | changes
    if data == "ascii":
        body = "".join(
            " ".join(repr(value.item()) for part in parts for value in part[row]) + "\n" for row in range(count)
        ).encode()
    else:
        body = b"".join(part[row].tobytes() for row in range(count) for part in parts)
    return (
        "# .PCD v0.7\n" + "".join(f"{key} {value}\n" for key, value in head.items() if value is not None)
    ).encode() + body


def write_sweep_file(path, columns):
    """Write x, y, z, intensity and ring in the format of a path's suffix, as far as it holds them."""
    table = np.column_stack([column.astype("<f4") for column in columns.values()])
    name = path.name
    if name.endswith(".bin"):
        path.write_bytes(np.ascontiguousarray(table[:, :4]).tobytes())
    elif name.endswith(".pcd"):
        path.write_bytes(pcd_text(columns))
    else:
        np.savez_compressed(path, **columns)
    return path
