"""Surfaces, the bodies they bound, and the design variables that determine them."""

from pneumorph.geometry.body import Body
from pneumorph.geometry.bspline import Basis, clamped, periodic
from pneumorph.geometry.design_space import (
    DesignSpace,
    FreeDatum,
    FreePressure,
    ShapeVariables,
    build_space,
    tied_coordinates,
)
from pneumorph.geometry.surface import Surface, TriangulatedSurface, Triangulation

__all__ = [
    "Basis",
    "Body",
    "DesignSpace",
    "FreeDatum",
    "FreePressure",
    "ShapeVariables",
    "Surface",
    "TriangulatedSurface",
    "Triangulation",
    "build_space",
    "clamped",
    "periodic",
    "tied_coordinates",
]
