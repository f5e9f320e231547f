"""B-spline surfaces, the bodies they bound, and the design variables that determine them."""

from pneumorph.geometry.body import Body, adjusted_columns, starting_body
from pneumorph.geometry.bspline import Basis, clamped, periodic
from pneumorph.geometry.cover import Cover, build_covers
from pneumorph.geometry.design_space import DesignSpace, FreeDatum, FreePressure, build_design_space
from pneumorph.geometry.level import Level, build_levels
from pneumorph.geometry.lining import Lining, build_linings
from pneumorph.geometry.tube import TubeSurface, cap_points, enclosed_volume
from pneumorph.geometry.wedge import Wedge, build_wedges

__all__ = [
    "Basis",
    "Body",
    "Cover",
    "DesignSpace",
    "FreeDatum",
    "FreePressure",
    "Level",
    "Lining",
    "TubeSurface",
    "Wedge",
    "adjusted_columns",
    "build_covers",
    "build_design_space",
    "build_levels",
    "build_linings",
    "build_wedges",
    "cap_points",
    "clamped",
    "enclosed_volume",
    "periodic",
    "starting_body",
]
