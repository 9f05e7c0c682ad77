"""A row of the stability page: one method in one regime."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One regime in which a method begins to fail.

    Parameters
    ----------
    method : str
        Method and its subject.
    regime : str
        Quantity that was increased until the method failed.
    begins : str
        Value at which it begins to fail, with unit and interval.
    how : str
        Method by which that was found.
    answer : str
        Response of the program.
    """

    method: str
    regime: str
    begins: str
    how: str
    answer: str
