"""Draw in a process of its own: VTK may end the process if there is no OpenGL, and others can draw meanwhile."""

from __future__ import annotations

import pickle
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType

import numpy as np

from pneumorph import extras
from pneumorph.errors import ComputationError
from pneumorph.interrupts import stop_if_asked
from pneumorph.output.view import JOBS, Job, drawn_name
from pneumorph.processes import program, python, temporary_folder

SECONDS, LOOK = 600, 0.02
"""How long drawing may take, and how often is looked whether a job is done."""

CHILD = "from pneumorph.output.draw import main; main()"


class NoPicture(ComputationError):
    """The picture cannot be drawn on this machine."""


class Drawing:
    """Jobs that are being drawn, by one process for all of them; to be used in a `with` statement."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._count, self._begin = len(jobs), time.monotonic()
        with ExitStack() as stack:
            self._folder = stack.enter_context(temporary_folder())
            (self._folder / JOBS).write_bytes(pickle.dumps(list(jobs)))
            command = python("-c", CHILD, str(self._folder))
            self._missing = extras.missing("pictures", "drawing bodies")
            self._process = None if self._missing else stack.enter_context(program(command))
            self._ends = stack.pop_all()

    def __enter__(self) -> Drawing:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ends.close()

    def images(self) -> Iterator[list[np.ndarray]]:
        """Yield the pictures of every job, in their order, once they are drawn; see `images`."""
        if self._process is None:
            raise NoPicture(self._missing)
        for number in range(self._count):
            path = self._folder / drawn_name(number)
            while not path.exists():
                ended = self._process.poll() is not None
                # The same Ctrl-C may have ended it.
                stop_if_asked()
                if ended and not path.exists():
                    raise NoPicture("VTK cannot draw off-screen here (no OpenGL)")
                if time.monotonic() - self._begin > SECONDS:
                    raise NoPicture(f"drawing took more than {SECONDS} s")
                time.sleep(LOOK)
            with np.load(path) as stored:
                yield [stored[name] for name in stored.files]


def images(job: Job) -> list[np.ndarray]:
    """A picture (height, width, 4) of every panel, transparent where there is no body.

    Raises
    ------
    NoPicture
        If PyVista is not installed, or this machine cannot draw off-screen.
    """
    with Drawing([job]) as drawing:
        (pictures,) = drawing.images()
        return pictures
