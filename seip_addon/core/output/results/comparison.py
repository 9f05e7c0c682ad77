"""Comparison of two placements on the same targets."""

import base64
import binascii
import zlib
from dataclasses import dataclass

import numpy as np

from ...arrays import Integer
from ...errors import SeipError
from ..pictures.coverage_colours import Colouring
from ..pictures.palette import COMPARED_COLOURS

NEITHER, BOTH, GAINED, LOST = range(4)
COMPARED_WORDS = ("seen in neither", "seen in both", "gained", "lost")


@dataclass(frozen=True, eq=False)
class Comparison:
    """Difference between two placements.

    Parameters
    ----------
    classes : (t,) int64
        `NEITHER`, `BOTH`, `GAINED` or `LOST` for each target.
    """

    classes: Integer

    @property
    def gained(self) -> int:
        """How many targets the other sees and the one does not."""
        return int(np.count_nonzero(self.classes == GAINED))

    @property
    def lost(self) -> int:
        """How many targets the one sees and the other does not."""
        return int(np.count_nonzero(self.classes == LOST))

    def colouring(self) -> Colouring:
        """Return the classes as the road shows them."""
        return Colouring(COMPARED_WORDS, COMPARED_COLOURS, self.classes)


def compare(one: Integer, other: Integer) -> Comparison:
    """Compare two placements.

    Parameters
    ----------
    one, other : (t,) int64
        How many sensors see each target.

    Raises
    ------
    SeipError
        They are of different targets.
    """
    if one.shape != other.shape:
        raise SeipError(
            f"the placements were made on {len(one):,} and on {len(other):,} targets: "
            "place again with the same target grid to compare target by target"
        )
    before, after = one > 0, other > 0
    return Comparison(np.select([before & after, after, before], [BOTH, GAINED, LOST], NEITHER).astype(np.int64))


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
