"""A body from a file with some of its closed voids filled."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pneumorph.cad.netgen_process import call
from pneumorph.cad.read import SECONDS, Format, in_file
from pneumorph.errors import MeshError
from pneumorph.processes import temporary_folder


def filled(data: bytes, form: Format, centres: np.ndarray) -> bytes:
    """The bytes of a BREP file of the same solid without some of its voids.

    Parameters
    ----------
    data, form : the contents of a STEP or BREP file.
    centres : (n, 3) array
        Centroids of the voids, in the unit of the file as it is read.

    Raises
    ------
    ComputationError
        If they cannot be filled; a sentence whose subject is the file.
    """
    if form not in ("step", "brep"):
        raise MeshError("is made of triangles; fill its voids in CAD, or save it as STEP")
    with in_file(data, form) as (path, key), temporary_folder() as folder:
        out = Path(folder) / "filled.brep"
        call("fill_voids", path, key, centres, str(out), seconds=SECONDS)
        return out.read_bytes()
