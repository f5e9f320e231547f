"""CAD files made for tests."""

from functools import cache
from pathlib import Path

PROBLEM = """
[material]
name = "Hei-Cast 8400"
[body]
file = "{file}"
{more}
[[task]]
name = "extend"
pressure = {{ A = "60 kPa" }}
objective = {{ motion = "extension" }}
[mesh]
size = "{size}"
element = "{element}"
"""


def problem(file, more="", size="3 mm", element="quadratic"):
    """The text of a problem with a body from a file and a chamber A."""
    return PROBLEM.format(file=file, more=more, size=size, element=element)


@cache
def occ():
    """Netgen's CAD kernel."""
    import netgen.occ

    return netgen.occ


def box(lower, upper):
    """A block between two corners, mm."""
    return occ().Box(occ().Pnt(*lower), occ().Pnt(*upper))


def cylinder(radius, start, end, x=0.0, y=0.0):
    """A cylinder along z, mm."""
    return occ().Cylinder(occ().Pnt(x, y, start), occ().Z, radius, end - start)


def written(shape, path: Path) -> Path:
    """The path of a STEP file with a shape."""
    shape.WriteStep(str(path))
    return path
