"""Comparison of a kept placement with the present one on the same targets."""

import base64
import binascii
import zlib
from functools import lru_cache

import numpy as np

from ...arrays import Integer
from ...errors import SeipError
from ..pictures.coverage_colours import Colouring
from ..pictures.palette import COMPARED_COLOURS

NEITHER, BOTH, PRESENT_ONLY, KEPT_ONLY = range(4)
"""Classes of targets by which of the two placements see them."""
CLASS_WORDS = ("seen by neither", "seen by both", "seen only by the present", "seen only by the kept")


def compare(kept: Integer, present: Integer) -> Colouring:
    """Compare two placements target by target.

    Parameters
    ----------
    kept, present : (t,) int64
        How many sensors of each placement see each target.

    Returns
    -------
    Colouring
        The class of each target: `NEITHER`, `BOTH`, `PRESENT_ONLY` or `KEPT_ONLY`.

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


@lru_cache(maxsize=8)  # a panel asks at every redraw
def compared_shares(kept: str, present: str) -> tuple[float, ...]:
    """Return the share of the targets in each class, 0 to 1, from two texts of `packed_counts`.

    Raises
    ------
    SeipError
        A text is damaged, or they are of different targets.
    """
    return tuple(compare(unpacked_counts(kept), unpacked_counts(present)).shares.tolist())


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
