"""All colours that mean something, in pictures, in the viewport and in files: coverage, sensors and areas share no hue.

Coverage is orange and blue, which colour-blind people tell apart, sensors are yellow, green and pink, and areas are red
and violet. Within a group colours differ in lightness as well, so that they remain distinct in greyscale. Functions
give targets and points their colours: by returns, coverage, weight, or comparison of two placements.

`tests/core/output/pictures/test_palette.py` shows its use.
"""

import base64
import binascii
import zlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...choosing.placement.deployment import Deployment
from ...choosing.placement.returns_summary import FEW_RETURNS
from ...sensing.scans.frame import STATIC_INSTANCE, Frame

INK = "#1d2b36"
SOFT_INK = "#5d6b76"
PAPER = "#ffffff"

SEEN_TWICE = 2
SEEN_COLOURS = ("#e8823c", "#8cc4e2", "#2c72a8")
"""Targets that no sensor, one sensor, two sensors or more see; lightness differs as well as hue."""
SEEN_WORDS = ("not seen", "seen by one sensor", "seen by two or more")
RETURNS_COLOURS = (SEEN_COLOURS[0], "#f6c9a8", *SEEN_COLOURS[1:])
"""Places by the returns that a pedestrian has there, from fewest to most; the first two are too few to be found."""
COMPARED_COLOURS = ("#8a8f94", "#cfd6db", SEEN_COLOURS[2], SEEN_COLOURS[0])
"""Targets seen by neither of two placements, by both, only by the present and only by the kept one."""
DENSE_BEAMS, WIDE_BEAMS = "#4dbfff", "#ff8c1a"
"""Beams on the road that leave no gap to the next, and of those that do: such road may go unseen."""
SHARE_COLOURS = ("#dcebf6", "#a9cfe9", "#6fa9d4", "#2c72a8", "#123f68")
"""Whole sites, from the least coverage or the fewest returns to the most; lightness alone tells them apart."""
HIDDEN_COLOUR, MISSED_COLOUR = INK, "#a3abb2"
"""Road that something hides from a sensor, and of road in its view that no beam of it returns from."""

SENSOR_COLOURS = ("#f0e442", "#12b886", "#f783c5", "#a8e05f", "#d6358c", "#7ff0d8", "#1f9d8a", "#cfd8dc")
"""Points of each sensor, on a dark ground; neighbours differ in lightness too."""
SENSOR_BODY, SIGHT_LINE = "#f2c230", "#ffd940"
POLE_COLOUR, ASSUMED_POLE_COLOUR = "#f2c94c", "#8a7400"
"""Poles, which may carry a sensor."""

WEIGHTED, FORBIDDEN, MANDATORY = "#5d1f7d", "#8f1d2c", "#4b3fb0"
REGION_VEIL, WEIGHTED_VEIL, FORBIDDEN_VEIL, MANDATORY_VEIL = "#d9d2ee", "#c04df0", "#f0304f", "#6f5dff"
"""Areas in the viewport, where three quarters of what is below shine through."""
WEIGHT_COLOURS = ("#f1e6f7", "#d7b8e8", "#b584d3", "#8a4fb3", "#4f2374")
"""From the lightest weight to the heaviest, in the hue of weighted areas; lightness alone tells them apart."""

MAP_GROUND, MAP_STREETS, MAP_JUNCTION = "#17191b", ("#53575b", "#83888d", "#b4b9be"), "#ffffff"
"""The map on which a junction is chosen: streets by importance. Greys: nothing on it is coverage or a sensor."""
PAPER_STREETS = ("#e3e7ea", "#cfd5d9", "#b7bfc5")
"""Streets on a map of sites, on paper, by importance."""
SERIES_COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Series of a chart, distinct for colour-blind readers (Okabe and Ito 2008)."""
NEW_COLOUR, GONE_COLOUR = "#d1242f", SERIES_COLOURS[1]
"""Objects that a scene lacks, and those that are no longer there."""

STATIC_COLOUR = "#7d8790"  # of points on what stands still, where road users have colours
INTENSITY_COLOURS = ("#27408b", "#1fa187", "#fde725", "#ffffff")
"""From no intensity to `MAX_INTENSITY`, evenly spaced along its square root."""
MAX_INTENSITY = 0.6  # intensity from which on returns have the last colour; below, colours go by its square root

Numbers = NDArray[np.floating[Any]]
By = Literal["sensor", "intensity", "instance"]
Aspect = Literal["returns", "seen", "times", "weights"]
RETURNS_CLASSES = (1.0, FEW_RETURNS, 20.0)
"""Returns from a pedestrian at which the classes of a plan change."""
GOLDEN_RATIO = 0.618033988749895  # of the colour circle, from a road user to the next: neighbours differ most
NEITHER, BOTH, PRESENT_ONLY, KEPT_ONLY = range(4)
"""Classes of targets by which of the two placements see them."""
CLASS_WORDS = ("seen by neither", "seen by both", "seen only by the present", "seen only by the kept")


@dataclass(frozen=True, eq=False)
class Legend:
    """Legend of the colours of targets: label, web colour and share of the targets (0 to 1) of each class."""

    title: str
    words: tuple[str, ...]
    colours: tuple[str, ...]
    shares: Float


@dataclass(frozen=True, eq=False)
class Colouring:
    """Classes of targets, each with its label and web colour; ``of`` (t,) is the class of each target."""

    words: tuple[str, ...]
    colours: tuple[str, ...]
    of: Integer
    title: str = "Road surface"

    @property
    def shares(self) -> Float:
        """Share of the targets in each class, 0 to 1."""
        share: Float = np.bincount(self.of, minlength=len(self.words)) / max(len(self.of), 1)
        return share


def rgb(colour: str) -> tuple[float, float, float]:
    """Return a web colour as shares of red, green and blue."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue


def of_placement(deployment: Deployment) -> Colouring:
    """Colour targets by what a placement was chosen for: returns from a pedestrian, or how many sensors see them."""
    returns = deployment.pedestrian_returns
    return as_placed(deployment.seen_by) if returns is None else by_returns(returns)


def by_returns(returns: Numbers) -> Colouring:
    """Colour targets by the expected returns from a pedestrian near each, (t,)."""
    ends = [f"{limit:g}" for limit in RETURNS_CLASSES]
    words = (f"below {ends[0]}", *(f"{low} to {high}" for low, high in pairwise(ends)), f"{ends[-1]} or more")
    of = np.searchsorted(RETURNS_CLASSES, returns, side="right")
    return Colouring(words, RETURNS_COLOURS, of, "Returns from a pedestrian on the road")


def as_placed(seen_by: Integer) -> Colouring:
    """Colour targets as pictures of a placement do."""
    return Colouring(SEEN_WORDS, SEEN_COLOURS, np.minimum(seen_by, SEEN_TWICE))


def colouring(aspect: Aspect, seen_by: Integer, weight: Float, returns: Numbers | None = None) -> Colouring:
    """Colour targets by one aspect.

    Parameters
    ----------
    aspect : {"returns", "seen", "times", "weights"}
        Returns from a pedestrian, whether some sensor sees a target, how many do, or its weight.
    seen_by : (t,) int64
        Number of sensors that see each target.
    weight, returns : (t,) float64

    Raises
    ------
    SeipError
        The aspect is returns, and there are none.
    """
    if aspect == "returns":
        if returns is None:
            raise SeipError("this placement was not chosen for returns from road users: choose another aspect")
        return by_returns(returns)
    if aspect == "seen":
        return Colouring(("not seen", "seen"), (SEEN_COLOURS[0], SEEN_COLOURS[-1]), np.minimum(seen_by, 1))
    if aspect == "times":
        return as_placed(seen_by)
    return _by_weight(weight)


def _by_weight(weight: Float) -> Colouring:
    """Group the weights into classes: one for each weight, or groups of neighbouring weights of equal size."""
    levels, of = np.unique(weight.round(6), return_inverse=True)
    groups = np.array_split(np.arange(len(levels)), min(len(levels), len(WEIGHT_COLOURS)))
    group_of = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    ends = [(levels[group[0]], levels[group[-1]]) for group in groups]
    words = tuple(f"weight {low:g}" if low == high else f"weight {low:g} to {high:g}" for low, high in ends)
    spread = np.linspace(0, len(WEIGHT_COLOURS) - 1, max(len(groups), 2)).round().astype(int)
    colours = tuple(WEIGHT_COLOURS[place] for place in spread[: len(groups)])
    return Colouring(words, colours, group_of[of.ravel()], "Weight")


def cloud_colours(frame: Frame, by: By) -> NDArray[np.float32]:
    """Return red, green, blue and opacity (n, 4) of each point, sRGB."""
    colours = np.ones((len(frame), 4), dtype=np.float32)
    if by == "sensor":
        palette = np.array([rgb(colour) for colour in SENSOR_COLOURS])
        colours[:, :3] = palette[frame.sensor % len(palette)]
    elif by == "intensity":
        colours[:, :3] = strength_ramp(np.sqrt(np.minimum(frame.intensity / MAX_INTENSITY, 1.0)))
    else:
        hue = (frame.instance * GOLDEN_RATIO) % 1.0
        wheel = np.abs((hue[:, None] + np.array([0.0, 2.0, 1.0]) / 3.0) % 1.0 * 6.0 - 3.0) - 1.0  # of HSV, saturated
        bright = 0.35 + 0.65 * np.clip(wheel, 0.0, 1.0)
        colours[:, :3] = np.where((frame.instance == STATIC_INSTANCE)[:, None], np.array(rgb(STATIC_COLOUR)), bright)
    return colours


def strength_ramp(share: Float) -> Float:
    """Return colours (…, 3) along the scale of intensities, from 0 to 1."""
    stops = np.array([rgb(colour) for colour in INTENSITY_COLOURS])
    places = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(share, places, channel) for channel in stops.T], axis=-1)


def sensor_colour(number: int) -> str:
    """Return the web colour of a sensor's points."""
    return SENSOR_COLOURS[number % len(SENSOR_COLOURS)]


def compare(kept: Integer, present: Integer) -> Colouring:
    """Colour targets by which of two placements see them, from the numbers of sensors of each that do, (t,) int64.

    Raises
    ------
    SeipError
        They are of different targets.
    """
    if kept.shape != present.shape:
        raise SeipError(
            f"the placements were made on {len(kept):,} and on {len(present):,} targets: "
            "place again with the same target grid to compare target by target"
        )
    before, after = kept > 0, present > 0
    classes = np.select([before & after, after, before], [BOTH, PRESENT_ONLY, KEPT_ONLY], NEITHER).astype(np.int64)
    return Colouring(CLASS_WORDS, COMPARED_COLOURS, classes, "Kept and present placement")


def packed_counts(seen_by: Integer) -> str:
    """Return counts as a text that a file can keep; 255 stands for more as well."""
    counts = np.minimum(seen_by, 255).astype(np.uint8)
    return base64.b64encode(zlib.compress(counts.tobytes(), 9)).decode("ascii")


def unpacked_counts(text: str) -> Integer:
    """Return the counts in a text of `packed_counts`.

    Raises
    ------
    SeipError
        It is damaged.
    """
    try:
        raw = zlib.decompress(base64.b64decode(text, validate=True))
    except (binascii.Error, zlib.error, ValueError) as error:
        raise SeipError("the counts kept with the placement are damaged: place the sensors again") from error
    return np.frombuffer(raw, dtype=np.uint8).astype(np.int64)
