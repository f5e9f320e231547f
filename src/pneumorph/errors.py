"""The errors that users see: each is one line that names the key or file, what is wrong, and how to fix it."""


class PneumorphError(Exception):
    """Base of every error that pneumorph raises on purpose."""


class ProblemError(PneumorphError):
    """The input is wrong: a problem file, a key in it, or an argument (exit status 2)."""


class ComputationError(PneumorphError):
    """The input is sound but the computation did not succeed (exit status 1)."""


class MeshError(ComputationError):
    """The body could not be meshed."""


class Renamed(FutureWarning):
    """A word of a problem file has a new name; the old one is still read."""
