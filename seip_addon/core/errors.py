"""The one error class for mistakes that a user can mend."""


class SeipError(Exception):
    """A mistake of the user's, in one sentence that names the thing and the cure.

    Operators turn it into a report and headless commands into one line on
    standard error with exit status 1; every other exception is a defect of
    this package and is left alone.
    """
