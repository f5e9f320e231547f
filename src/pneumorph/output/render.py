"""Draw in a process of its own: VTK may end the process if there is no OpenGL, and others can draw meanwhile."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.output.view import JOBS, Job, drawn_name

SECONDS, LOOK = 600, 0.02
"""How long drawing may take, and how often is looked whether a job is done."""

CHILD = "from pneumorph.output.draw import main; main()"


class NoPicture(ComputationError):
    """The picture cannot be drawn on this machine."""


class Drawing:
    """Jobs that are being drawn, by one process for all of them; to be used in a `with` statement."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._folder = tempfile.TemporaryDirectory()
        (Path(self._folder.name) / JOBS).write_bytes(pickle.dumps(list(jobs)))
        command = [sys.executable, "-c", CHILD, self._folder.name]
        self._count, self._begin = len(jobs), time.monotonic()
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def __enter__(self) -> Drawing:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()

    def images(self) -> Iterator[list[np.ndarray]]:
        """Yield the pictures of every job, in their order, once they are drawn; see `images`."""
        for number in range(self._count):
            path = Path(self._folder.name) / drawn_name(number)
            while not path.exists():
                ended = self._process.poll() is not None
                if ended and not path.exists():
                    raise NoPicture("VTK cannot draw off-screen here (no OpenGL)")
                if time.monotonic() - self._begin > SECONDS:
                    raise NoPicture(f"drawing took more than {SECONDS} s")
                time.sleep(LOOK)
            with np.load(path) as found:
                yield [found[name] for name in found.files]


def images(job: Job) -> list[np.ndarray]:
    """A picture (height, width, 4) of every panel, transparent where there is no body.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    with Drawing([job]) as drawing:
        (pictures,) = drawing.images()
        return pictures
