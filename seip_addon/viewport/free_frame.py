"""Part of a viewport that neither its header, its toolbar nor its sidebar covers."""

from collections.abc import Iterable

import bpy

Box = tuple[float, float, float, float]
"""Left, bottom, right and top, pixels."""
BALL_MARGIN, BUTTONS_WIDE, BUTTONS_TALL = 24.0, 46.0, 130.0
"""Pixels at the interface's usual scale: around the ball of navigation, and of the four buttons below it."""


def free_frame(area: bpy.types.Area, region: bpy.types.Region) -> Box:
    """Return the free part of a viewport's window, in pixels of that window."""
    others = [(one.alignment, _box(one)) for one in area.regions if one != region and min(one.width, one.height) > 1]
    left, bottom, right, top = uncovered(_box(region), others)
    return left - region.x, bottom - region.y, right - region.x, top - region.y


def uncovered(window: Box, others: Iterable[tuple[str, Box]]) -> Box:
    """Return what is left of a window beside boxes that lie over its edges.

    Parameters
    ----------
    others : iterable of (str, Box)
        Edge at which each box lies (``LEFT``, ``RIGHT``, ``TOP``, ``BOTTOM``), and the box.
    """
    left, bottom, right, top = window
    for edge, box in others:
        if box[0] >= window[2] or box[2] <= window[0] or box[1] >= window[3] or box[3] <= window[1]:
            continue
        if edge == "LEFT":
            left = max(left, box[2])
        elif edge == "RIGHT":
            right = min(right, box[0])
        elif edge == "TOP":
            top = min(top, box[1])
        elif edge == "BOTTOM":
            bottom = max(bottom, box[3])
    return left, bottom, max(left, right), max(bottom, top)


def navigation_boxes(space: bpy.types.SpaceView3D, frame: Box, scale: float) -> list[Box]:
    """Return where Blender draws the gizmos of navigation in the free part of a viewport: the ball, and the buttons.

    Blender tells no script where its gizmos are: the sizes are those of its drawing code.

    Parameters
    ----------
    frame : (left, bottom, right, top), pixels
        Free part of the viewport.
    scale : float
        Scale of the interface.
    """
    view = bpy.context.preferences.view
    if not (space.show_gizmo and space.show_gizmo_navigate and view.show_navigate_ui):
        return []
    _, _, right, top = frame
    ball = view.gizmo_size_navigate_v3d + BALL_MARGIN
    boxes = [(ball, ball), (BUTTONS_WIDE, ball + BUTTONS_TALL)]
    return [(right - wide * scale, top - tall * scale, right, top) for wide, tall in boxes]


def _box(region: bpy.types.Region) -> Box:
    return region.x, region.y, region.x + region.width, region.y + region.height
