"""Lengths and counts as mappers write them: ``12``, ``12 m``, ``40'``, ``39 ft 4 in``, ``3;4``."""

import re

_METRES = {"": 1.0, "m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01, "km": 1000.0}
_FOOT, _INCH = 0.3048, 0.0254
_PLAIN = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*([a-z]*)")
_NUMBER, _INCHES = r"(\d+(?:[.,]\d+)?)", r"\s*(?:\"|''|in|inch|inches)\.?"
_FEET = re.compile(rf"{_NUMBER}\s*(?:'|ft|feet|foot)\.?\s*(?:{_NUMBER}(?:{_INCHES})?)?")
_ONLY_INCHES = re.compile(_NUMBER + _INCHES)
_SIGNS = str.maketrans({"\u2032": "'", "\u2019": "'", "\u2033": '"', "\u201d": '"', "\u00a0": " ", "~": ""})
"""Prime and quotation marks of typography that stand for feet and inches, and signs to leave out."""


def metres(text: str | None, most: float) -> float | None:
    """Parse a length in metres; the largest of several (``3;4``).

    Parameters
    ----------
    text : str or None
        Value of a tag.
    most : float, metres
        Largest valid length.

    Returns
    -------
    float or None
        None if the text has no length above zero and up to ``most``.
    """
    lengths = [_metres(one.strip().lower()) for one in (text or "").translate(_SIGNS).split(";")]
    sound = [length for length in lengths if length is not None and 0.0 < length <= most]
    return max(sound, default=None)


def count(text: str | None, most: float) -> float | None:
    """Parse a count (levels, lanes) between 0 and ``most``; the largest of several, None if there is no valid one."""
    numbers = [match for one in (text or "").split(";") if (match := _PLAIN.fullmatch(one.strip())) and not match[2]]
    sound = [value for match in numbers if 0.0 <= (value := _number(match[1])) <= most]
    return max(sound, default=None)


def _metres(text: str) -> float | None:
    if match := _PLAIN.fullmatch(text):
        unit = _METRES.get(match[2])
        if unit is not None:
            return unit * _number(match[1])
    if match := _FEET.fullmatch(text):
        return _FOOT * _number(match[1]) + _INCH * _number(match[2] or "0")
    if match := _ONLY_INCHES.fullmatch(text):
        return _INCH * _number(match[1])
    return None


def _number(text: str) -> float:
    return float(text.replace(",", "."))
