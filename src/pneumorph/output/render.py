"""Drawing in a process of its own: where there is no OpenGL, VTK may end the process."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from pneumorph.output.view import Job

SECONDS = 600
CHILD = "from pneumorph.output.draw import main; main()"


class NoPicture(Exception):
    """The picture could not be made on this machine."""


def images(job: Job) -> list[np.ndarray]:
    """A picture (height, width, 3) of every shape.

    Raises
    ------
    NoPicture
        Where this machine cannot draw off-screen.
    """
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder) / "job", Path(folder) / "images.npz"
        asked.write_bytes(pickle.dumps(job))
        command = [sys.executable, "-c", CHILD, str(asked), str(answered)]
        try:
            subprocess.run(command, capture_output=True, timeout=SECONDS, check=True)
            with np.load(answered) as found:
                return [found[name] for name in found.files]
        except subprocess.TimeoutExpired:
            raise NoPicture(f"drawing took more than {SECONDS} s") from None
        except (subprocess.CalledProcessError, OSError):
            raise NoPicture("VTK cannot draw off-screen here (no OpenGL)") from None
