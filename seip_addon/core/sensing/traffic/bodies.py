"""Bodies of road users: closed meshes of few triangles, stretched to a road user's size."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.arrays import Float, Text
from ...base.errors import SeipError
from .trajectories import CATEGORIES, RoadUser, bent

MESHES = Path(__file__).parent / "body_meshes"
"""Folder of Wavefront OBJ files, ``CATEGORY.obj`` or ``CATEGORY.MODEL.obj``; its README describes their contents."""

REFLECTIVITY: Mapping[str, float] = {
    "glass": 0.05,  # nearly all light is transmitted or reflected like in a mirror
    "tyre": 0.05,
    "trim": 0.08,
    "rim": 0.45,
    "frame": 0.35,
    "headlamp": 0.60,
    "tail lamp": 0.60,  # it has retroreflectors
    "cargo box": 0.65,
    "skin": 0.50,
    "hair": 0.20,
    "trousers": 0.25,
}
"""Assumed reflectivity of each material in the near infrared (905 nm); paint and clothes have that of the road user."""

PAINT_COLOURS = (
    *((0.12, "black"), (0.24, "blue"), (0.34, "green"), (0.44, "red"), (0.56, "grey"), (0.70, "silver")),
    (1.00, "white"),
)
"""Colours of paint and clothes, each with the largest reflectivity that it is shown for."""

KEPT_BODIES = 4096  # size of the cache of bodies by size, shape and paint

PAINTED_MATERIALS = ("paint", "cloth")  # with the road user's reflectivity; bodies add the colour: ``paint red``


@dataclass(frozen=True, eq=False)
class Body:
    """The surface of a road user in its own axes; n triangles.

    The origin is the centre of the underside; x points forward, y left, z up.
    Arrays are shared between road users of one size and cannot be written.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners, counter-clockwise as seen from outside; the closed parts of a body may intersect.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    material : (n,) str
        Keys of `scene.materials.COLOURS`.
    """

    triangles: Float
    reflectivity: Float
    material: Text

    def __len__(self) -> int:
        return len(self.triangles)


def fitted_body(user: RoadUser) -> Body:
    """Return the body of a road user, whose bounding box is exactly its length × width × height.

    Road users of one category, size, shape and paint get the same object, and
    those of one category, size and shape the same array of triangles.

    Raises
    ------
    SeipError
        The category or the size is invalid.
    """
    if user.category not in CATEGORIES:
        raise SeipError(
            f"road user {user.name!r} is a {user.category!r}, which has no body; it may be {', '.join(CATEGORIES)}"
        )
    size = (user.length, user.width, user.height)
    if not all(0 < side < np.inf for side in size):
        raise SeipError(
            f"road user {user.name!r} is {' × '.join(f'{side:g}' for side in size)} m large; "
            "give its type a length, width and height above zero"
        )
    return _painted(user.category, size, user.shape, user.paint)


def colour_of(paint: float) -> str:
    """Return the colour in which a reflectivity of paint or clothes is shown."""
    return next((name for limit, name in PAINT_COLOURS if paint <= limit), PAINT_COLOURS[-1][1])


@functools.lru_cache(KEPT_BODIES)
def _painted(category: str, size: tuple[float, ...], shape: tuple[float, ...], paint: float) -> Body:
    triangles, material = _shaped(category, size, shape)
    painted = np.isin(material, PAINTED_MATERIALS)
    reflectivity = np.array([paint if own else REFLECTIVITY[name] for name, own in zip(material, painted, strict=True)])
    named = np.where(painted, np.char.add(material, f" {colour_of(paint)}"), material)
    for array in (reflectivity, named):
        array.flags.writeable = False
    return Body(triangles, reflectivity, named)


@functools.lru_cache(KEPT_BODIES)
def _shaped(category: str, size: tuple[float, ...], shape: tuple[float, ...]) -> tuple[Float, Text]:
    """Return the mesh of the model nearest in size, bent to a shape and scaled to the size.

    The nearest model is the one whose length, width and height have to be scaled least, by the sum of squared
    logarithms.
    """
    triangles, material = min(
        _models(category), key=lambda model: float((np.log(size / np.ptp(model[0], axis=(0, 1))) ** 2).sum())
    )
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    share = (triangles - low) / (high - low)
    if any(shape):
        share[..., 0] = bent(share[..., 0], *shape[:2])
        share[..., 2] = bent(share[..., 2], *shape[2:])
    stretched: Float = (share - [0.5, 0.5, 0.0]) * size
    stretched.flags.writeable = False
    return stretched, material


@functools.cache
def _models(category: str) -> list[tuple[Float, Text]]:
    """Return the triangles (n, 3, 3) and materials (n,) of every model of a category."""
    paths = sorted(path for path in MESHES.glob("*.obj") if path.name.split(".")[0] == category)
    if not paths:
        raise SeipError(f"{MESHES} has no mesh of a {category}; install the add-on again")
    return [read_mesh(path) for path in paths]


def read_mesh(path: Path) -> tuple[Float, Text]:
    """Read the mesh of a body from a Wavefront OBJ file of triangles.

    Returns
    -------
    triangles : (n, 3, 3) float64, metres
        Corners of the triangles.
    material : (n,) str
        Material of each triangle.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    material: list[str] = []
    name = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        match line.split():
            case ["v", x, y, z, *_]:
                vertices.append([float(x), float(y), float(z)])
            case ["usemtl", name]:
                name = name.replace("_", " ")
            case ["f", *corners]:
                faces.append([int(corner.split("/")[0]) - 1 for corner in corners])
                material.append(name)
    return np.array(vertices)[np.array(faces)], np.array(material)
