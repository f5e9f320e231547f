"""Surfaces, the bodies they bound, and the design variables that determine them."""

from pneumorph.geometry.body import Body
from pneumorph.geometry.bspline import Basis, clamped, periodic
from pneumorph.geometry.design_space import DesignSpace, FreeDatum, FreePressure
from pneumorph.geometry.surface import Surface

__all__ = [
    "Basis",
    "Body",
    "DesignSpace",
    "FreeDatum",
    "FreePressure",
    "Surface",
    "clamped",
    "periodic",
]
