"""`SeipError`, the exception for mistakes that a user can correct.

`tests/core/base/test_basics.py` shows its use.
"""

import re

_MAX_LENGTH = 600  # characters
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")


class SeipError(Exception):
    """A mistake of the user, described in one sentence that names the thing and the cure.

    Operators turn it into a report, and headless commands into one line on standard error with exit status 1. All
    other exceptions are defects of this package and are not caught. The middle of very long sentences is cut out, and
    control characters, which names in files may contain, are replaced.
    """

    def __init__(self, sentence: str) -> None:
        readable = _CONTROL.sub(lambda found: " " if found[0].isspace() else "\N{REPLACEMENT CHARACTER}", sentence)
        half = (_MAX_LENGTH - 3) // 2
        super().__init__(readable if len(readable) <= _MAX_LENGTH else f"{readable[:half]} … {readable[-half:]}")
