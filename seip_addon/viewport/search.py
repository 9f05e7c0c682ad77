"""The best placement that a search has found so far: its sensors on their posts, before any object is written."""

import bpy
import numpy as np

from ..core.base.progress import Progress
from ..core.output.pictures.palette import SENSOR_BODY, rgb
from ..core.workflows.survey import Layout
from ..state.overlay import Block, Colour, Entry, Label, Layer, Overlay

NAME = "search"
COLOUR: Colour = (*rgb(SENSOR_BODY), 1.0)
DOT, POST = 12.0, 3.0  # pixels at the interface's usual scale


def search_overlay(layout: Layout, found: Progress) -> Overlay:
    """Return the sensors of the placement that a search reports, with its value in the legend."""
    candidates, poses = layout.site.candidates, list(found.poses)
    eyes = candidates.xyz[poses]
    feet = candidates.position[candidates.position_of[poses]]
    posts = np.stack((feet, eyes), axis=1).reshape(-1, 3)
    layers = (
        Layer("LINES", posts.astype(np.float32), COLOUR, POST),
        Layer("POINTS", eyes.astype(np.float32), COLOUR, DOT),
    )
    value = found.best.partition(",")[0]  # returns are followed by those from each kind of road user
    block = Block("Searching", (Entry(f"best so far: {value}", (COLOUR,)),))
    names = [layout.models[key].short_name for key in candidates.sensor[poses]]
    labels: list[Label] = list(zip(names, map(tuple, eyes.tolist()), strict=True))

    def legend(_scene: bpy.types.Scene) -> Block:
        return block

    return Overlay(layers, legend, labels=lambda _scene: labels)
