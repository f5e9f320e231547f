"""Draw in a process of its own, because VTK may end the process if there is no OpenGL."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.output.view import Job

SECONDS = 600
CHILD = "from pneumorph.output.draw import main; main()"


class NoPicture(ComputationError):
    """The picture cannot be drawn on this machine."""


def images(job: Job) -> list[np.ndarray]:
    """A picture (height, width, 4) of every panel, transparent where there is no body.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, destination = Path(folder) / "job", Path(folder) / "images.npz"
        source.write_bytes(pickle.dumps(job))
        command = [sys.executable, "-c", CHILD, str(source), str(destination)]
        try:
            subprocess.run(command, capture_output=True, timeout=SECONDS, check=True)
            with np.load(destination) as found:
                return [found[name] for name in found.files]
        except subprocess.TimeoutExpired:
            raise NoPicture(f"drawing took more than {SECONDS} s") from None
        except (subprocess.CalledProcessError, OSError):
            raise NoPicture("VTK cannot draw off-screen here (no OpenGL)") from None
