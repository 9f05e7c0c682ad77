"""Numbers that make equal names distinct."""

from collections import Counter
from collections.abc import Iterable


def distinct_names(names: Iterable[str], numbered: str = "{}-{}") -> list[str]:
    """Return each name, with a number from 2 on where an earlier one is the same or has that number already.

    Upper and lower case are the same, as on many disks.

    Parameters
    ----------
    numbered : str
        Format of a name with its number.

    Examples
    --------
    >>> distinct_names(["a", "a", "a-2", "A", "b"])
    ['a', 'a-2', 'a-2-2', 'A-3', 'b']
    """
    numbers: Counter[str] = Counter()
    taken: set[str] = set()
    found = []
    for name in names:
        key, other = name.casefold(), name
        while other.casefold() in taken:
            numbers[key] += 1
            other = numbered.format(name, numbers[key] + 1)
        taken.add(other.casefold())
        found.append(other)
    return found
