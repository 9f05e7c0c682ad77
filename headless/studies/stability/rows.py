"""A row of the stability page: one method in one regime."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One regime in which a method begins to fail.

    Parameters
    ----------
    method : str
        The method, and on what.
    regime : str
        The quantity that was increased until it failed.
    begins : str
        Where it begins to fail, with units and the interval of the estimate.
    how : str
        How that was found.
    answer : str
        What the program does about it.
    """

    method: str
    regime: str
    begins: str
    how: str
    answer: str
