"""Many tests are about the same bodies: what is between their surfaces is filled once, by the first that needs it."""

import os
import pickle
from hashlib import sha256
from pathlib import Path

from pneumorph.mesh import build


def share_meshes(folder: Path, patch) -> None:
    """Keep filled meshes in a folder, by all that they are made from; processes with the same folder share them."""
    folder.mkdir(exist_ok=True)
    fill = build.fill

    def fill_once(*given):
        path = folder / sha256(pickle.dumps(given)).hexdigest()
        if path.exists():
            return pickle.loads(path.read_bytes())
        made = fill(*given)
        written = path.with_suffix(f".{os.getpid()}")
        written.write_bytes(pickle.dumps(made))
        written.replace(path)
        return made

    patch.setattr(build, "fill", fill_once)
