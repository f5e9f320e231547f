"""Files for manufacturing: the body and its chambers as exact CAD and as triangles, with checks of the files.

The libraries that read and write them are large and come with the extra ``cad``: ``pip install 'pneumorph[cad]'``.
"""

from pneumorph.make.libraries import load

# Before anything imports OCP: its OpenCASCADE must not mix symbols with the one that Netgen brings.
load()

from pneumorph.make.checks import Check, check_mesh, check_step  # noqa: E402
from pneumorph.make.faces.files import make_faces  # noqa: E402
from pneumorph.make.files import MadeFiles, make  # noqa: E402
from pneumorph.make.mould.effect import PortEffect  # noqa: E402
from pneumorph.make.mould.plan import Plan  # noqa: E402
from pneumorph.make.printing import read_3mf, read_stl, write_3mf, write_stl  # noqa: E402
from pneumorph.make.silicone.plan import SiliconePlan  # noqa: E402
from pneumorph.make.silicone.sag import Sag, grids, sag_of  # noqa: E402
from pneumorph.make.solid import fill_chamber  # noqa: E402
from pneumorph.make.step import read_step, write_body_step, write_chamber_step  # noqa: E402
from pneumorph.make.triangles import Triangles, triangulate  # noqa: E402

__all__ = [
    "Check",
    "MadeFiles",
    "Plan",
    "PortEffect",
    "Sag",
    "SiliconePlan",
    "Triangles",
    "check_mesh",
    "check_step",
    "fill_chamber",
    "grids",
    "make",
    "make_faces",
    "read_3mf",
    "read_step",
    "read_stl",
    "sag_of",
    "triangulate",
    "write_3mf",
    "write_body_step",
    "write_chamber_step",
    "write_stl",
]
