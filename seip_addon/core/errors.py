"""`SeipError`, the exception for mistakes that a user can correct.

`tests/core/test_errors.py` shows its use.
"""

_MAX_LENGTH = 1000


class SeipError(Exception):
    """A mistake of the user, described in one sentence that names the thing and the cure.

    Operators turn it into a report, and headless commands into one line on standard error with exit status 1. All
    other exceptions are defects of this package and are not caught. The middle of very long sentences is cut out.
    """

    def __init__(self, sentence: str) -> None:
        half = _MAX_LENGTH // 2
        super().__init__(sentence if len(sentence) <= _MAX_LENGTH else f"{sentence[:half]} … {sentence[-half:]}")
