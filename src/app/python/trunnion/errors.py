"""What a call raises. The text of an exception is what the program prints, and `code` is its exit code."""


class Error(Exception):
    """Any of the others."""

    code = 70


class CheckFailed(Error):
    """The work was done and a check failed: tolerance, limits, a pose out of reach. There is no program then."""

    code = 1


class WrongUse(Error, ValueError):
    """An argument or an option that cannot be."""

    code = 2


class WrongInput(Error, ValueError):
    """What a file says: `file:line:column: error: what`."""

    code = 3


class InputOutput(Error, OSError):
    """A file that cannot be read or written, memory or a thread not be had."""

    code = 4


class Defect(Error):
    """A defect of trunnion itself: please report it."""


class Warning(UserWarning):  # noqa: A001
    """What the program would print as a warning."""


def error_of(code: int, text: str) -> Error:
    """The exception of an exit code."""
    kinds = {kind.code: kind for kind in (CheckFailed, WrongUse, WrongInput, InputOutput)}
    return kinds.get(code, Defect)(text)
