"""Picture of a viewport as an array of pixels: the scene, overlays and the legend."""

import bpy
import gpu
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from .overlays import draw_overlays, draw_words

WIDTH = 1920  # pixels


def view_pixels(scene: bpy.types.Scene, area: bpy.types.Area) -> NDArray[np.uint8]:
    """Return a viewport as it stands, without its panels and handles, (h, w, 4), the uppermost row first."""
    region = next(region for region in area.regions if region.type == "WINDOW")
    space = area.spaces.active
    view, projection = space.region_3d.view_matrix, space.region_3d.window_matrix
    height = round(WIDTH * region.height / region.width)
    offscreen = gpu.types.GPUOffScreen(WIDTH, height)
    try:
        offscreen.draw_view3d(scene, scene.view_layers[0], space, region, view, projection, do_color_management=True)
        with offscreen.bind():
            _draw_over(scene, view, projection, height)
            buffer = gpu.state.active_framebuffer_get().read_color(0, 0, WIDTH, height, 4, 0, "UBYTE")
        buffer.dimensions = WIDTH * height * 4
        return np.array(buffer, dtype=np.uint8).reshape(height, WIDTH, 4)[::-1]
    finally:
        offscreen.free()


def _draw_over(scene: bpy.types.Scene, view: Matrix, projection: Matrix, height: int) -> None:
    """Draw the layers in the view's matrices and the legend in pixels."""
    scale = WIDTH / 1200.0  # a report's reader sees it smaller than its maker
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_matrix(view)
        gpu.matrix.load_projection_matrix(projection)
        draw_overlays(scene)
        gpu.matrix.load_matrix(Matrix.Identity(4))
        gpu.matrix.load_projection_matrix(_pixels(WIDTH, height))
        draw_words(scene, projection @ view, (WIDTH, height), (0, 0, WIDTH, height), scale)


def _pixels(width: int, height: int) -> Matrix:
    """Return the projection under which coordinates are pixels from the lower left."""
    return Matrix(((2 / width, 0, 0, -1), (0, 2 / height, 0, -1), (0, 0, -0.01, 0), (0, 0, 0, 1)))
