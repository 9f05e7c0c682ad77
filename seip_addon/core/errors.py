"""`SeipError`, the exception for mistakes that a user can correct."""

_MAX_LENGTH = 1000


class SeipError(Exception):
    """A mistake of the user's, in one sentence that names the thing and the cure.

    Operators turn it into a report and headless commands into one line on standard error with exit status 1; every
    other exception is a defect of this package and is left alone. A sentence that repeats more of a file than anybody
    reads loses its middle.
    """

    def __init__(self, sentence: str) -> None:
        half = _MAX_LENGTH // 2
        super().__init__(sentence if len(sentence) <= _MAX_LENGTH else f"{sentence[:half]} … {sentence[-half:]}")
