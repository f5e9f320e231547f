"""Files for manufacturing: the body and its chambers as exact CAD and as triangles, with checks of the files.

The libraries that read and write them are large and come with the extra ``cad``: ``pip install 'pneumorph[cad]'``.
"""

from pneumorph.make.libraries import load

# Before anything imports OCP: its OpenCASCADE must not mix symbols with the one that Netgen brings.
load()

from pneumorph.make.checks import Check, mesh_checks, step_checks  # noqa: E402
from pneumorph.make.files import MadeFiles, make  # noqa: E402
from pneumorph.make.mould.effect import PortEffect  # noqa: E402
from pneumorph.make.mould.plan import Plan  # noqa: E402
from pneumorph.make.printing import read_3mf, read_stl, write_3mf, write_stl  # noqa: E402
from pneumorph.make.solid import filled  # noqa: E402
from pneumorph.make.step import body_step, chamber_step, read_step  # noqa: E402
from pneumorph.make.triangles import Triangles, triangles  # noqa: E402

__all__ = [
    "Check",
    "MadeFiles",
    "Plan",
    "PortEffect",
    "Triangles",
    "body_step",
    "chamber_step",
    "filled",
    "make",
    "mesh_checks",
    "read_3mf",
    "read_step",
    "read_stl",
    "step_checks",
    "triangles",
    "write_3mf",
    "write_stl",
]
