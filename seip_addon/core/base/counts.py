"""Numbers as people type and read them: counted nouns, durations and round numbers."""

import math


def counted(number: int, one: str, several: str = "") -> str:
    """Return a number followed by a noun in singular or plural.

    Parameters
    ----------
    number : int
        Number of things.
    one : str
        Singular, with all words that depend on the number: "outline that crosses itself".
    several : str, optional
        Plural, also used for zero; by default ``one`` with an "s".

    Examples
    --------
    >>> counted(1, "sensor"), counted(1200, "crossing"), counted(0, "body", "bodies")
    ('1 sensor', '1,200 crossings', '0 bodies')
    """
    return f"{number:,} {one if number == 1 else several or f'{one}s'}"


def typed_number(text: str) -> float:
    """Return the number in a text; raise ValueError for anything else, such as digits that are not ASCII."""
    if not text.isascii():
        raise ValueError(text)
    return float(text)


def is_number(text: str) -> bool:
    """Return whether a text is a finite number."""
    try:
        return math.isfinite(typed_number(text))
    except ValueError:
        return False


def duration_text(seconds: float) -> str:
    """Return a duration as text, rounded as people state it: ``45 s``, ``3 min``, ``1.5 h``."""
    if seconds < 100:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def round_number(most: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is at most a positive number."""
    decade = 10.0 ** math.floor(math.log10(most))
    return max(step * decade for step in (1, 2, 5) if step * decade <= most)
