"""Draw in a process of its own: VTK may end the process if there is no OpenGL, and others can draw meanwhile."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.output.view import Job

SECONDS = 600
CHILD = "from pneumorph.output.draw import main; main()"


class NoPicture(ComputationError):
    """The picture cannot be drawn on this machine."""


class Drawing:
    """Jobs that are being drawn, by one process for all of them; to be used in a `with` statement."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._folder = tempfile.TemporaryDirectory()
        source, self._found = Path(self._folder.name) / "jobs", Path(self._folder.name) / "images.npz"
        source.write_bytes(pickle.dumps(list(jobs)))
        command = [sys.executable, "-c", CHILD, str(source), str(self._found)]
        self._counts = [len(job.panels) for job in jobs]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def __enter__(self) -> Drawing:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()

    def images(self) -> list[list[np.ndarray]]:
        """Wait for the pictures of every job; see `images`."""
        try:
            status = self._process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            raise NoPicture(f"drawing took more than {SECONDS} s") from None
        if status != 0 or not self._found.exists():
            raise NoPicture("VTK cannot draw off-screen here (no OpenGL)")
        with np.load(self._found) as found:
            pictures = iter([found[name] for name in found.files])
            return [[next(pictures) for _ in range(count)] for count in self._counts]


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
