"""Counted nouns for messages: "1 tree", "1,200 trees"."""


def counted(number: int, one: str, several: str = "") -> str:
    """Return a number with what it counts.

    Parameters
    ----------
    number : int
    one : str
        What a single one is called, with all words that depend on the number: "outline that crosses itself".
    several : str, optional
        What any other number, zero included, is called; by default ``one`` with an "s".
    """
    return f"{number:,} {one if number == 1 else several or f'{one}s'}"
