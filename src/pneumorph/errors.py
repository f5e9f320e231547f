"""Errors for users: one line each, naming the key or file, what is wrong, and how to fix it."""

import re
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

_BREAK = re.compile(r"(?<! ) *+[\t-\r\x1c-\x1f\x85\u2028\u2029]\s*+")


def printable(text: str) -> str:
    """A text in one line that does nothing to a terminal: control characters are shown escaped."""
    line = _BREAK.sub(" ", text).strip()
    if line.isprintable():
        return line
    return "".join(
        part if part.isprintable() or unicodedata.category(part) == "Zs" else part.encode("unicode_escape").decode()
        for part in line
    )


def short(value: object, most: int = 60) -> str:
    """A value of a file as it is repeated in a message: its beginning, if it is long."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"of about {round(0.30103 * value.bit_length())} digits"
    text = str(value)
    return text if len(text) <= most else f"{text[:most]}… ({len(text)} characters)"


def clipped(text: str, most: int) -> str:
    """A message of at most so many characters: its middle is left out, for the end says how to fix what is wrong."""
    if len(text) <= most:
        return text
    head = 2 * most // 3
    return f"{text[:head]} … {text[len(text) - (most - head - 3) :]}"


class PneumorphError(Exception):
    """Base class of all errors that pneumorph raises deliberately."""

    def __init__(self, message: object = ""):
        super().__init__(printable(str(message)))


class ProblemError(PneumorphError):
    """The input is invalid: a problem file, a key in it, or an argument (exit status 2).

    Attributes
    ----------
    faults : tuple of str
        All faults that were found, one line each; the message is the first, and how many more there are.
    """

    def __init__(self, message: str, faults: Sequence[str] = ()):
        super().__init__(message)
        self.faults = tuple(printable(fault) for fault in faults) or (str(self),)


@contextmanager
def writing(what: object, instead: str = "name another file") -> Iterator[None]:
    """ProblemError, one line, where something cannot be written; `instead` says how to fix it."""
    try:
        yield
    except OSError as error:
        raise ProblemError(f"{what}: cannot be written ({error.strerror or error}); {instead}") from None


class ComputationError(PneumorphError):
    """The input is valid but the computation failed (exit status 1)."""


class Hopeless(ComputationError):
    """What was given is valid key by key, but nothing can come of it together (exit status 2).

    The start of a problem has no state, or no body near it satisfies the limits; a measured curve is not one of the
    body; no pressures within the bounds have a stable state.
    """


class NotWritten(ComputationError):
    """Results could not be written: the disk is full, or the directory cannot be written to."""


class MeshError(ComputationError):
    """The body could not be meshed."""


class Renamed(FutureWarning):
    """A name used in a problem file has changed; the old one is still accepted."""
