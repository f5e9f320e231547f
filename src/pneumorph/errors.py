"""Errors that users see: one line each, naming the key or file, what is wrong, and how to fix it."""

from collections.abc import Sequence


class PneumorphError(Exception):
    """Base class of all errors that pneumorph raises deliberately."""


class ProblemError(PneumorphError):
    """The input is invalid: a problem file, a key in it, or an argument (exit status 2).

    Attributes
    ----------
    faults : tuple of str
        All faults that were found, one line each; the message is the first, and how many more there are.
    """

    def __init__(self, message: str, faults: Sequence[str] = ()):
        super().__init__(message)
        self.faults = tuple(faults) or (message,)


class ComputationError(PneumorphError):
    """The input is valid but the computation failed (exit status 1)."""


class MeshError(ComputationError):
    """The body could not be meshed."""


class Renamed(FutureWarning):
    """A name used in a problem file has changed; the old one is still accepted."""
