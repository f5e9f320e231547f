"""Have the pictures of a mould drawn, in a process of their own: VTK may end it if there is no OpenGL."""

from __future__ import annotations

import subprocess
from pathlib import Path

from pneumorph import extras
from pneumorph.processes import program, python, wait

_CHILD = "from pneumorph.make.mould.picture import main; main()"
_SECONDS = 300
"""After which a drawing that has not ended is given up."""


def draw_mould(folder: Path, path: Path) -> bool:
    """Draw the pieces in a folder; False if PyVista is not installed, or this machine cannot draw."""
    if extras.missing("pictures", "the picture"):
        return False
    try:
        with program(python("-c", _CHILD, str(folder), str(path))) as process:
            wait(process, _SECONDS)
            return process.returncode == 0 and path.exists()
    except (subprocess.SubprocessError, OSError):
        return False
