"""Bodies of tubes: B-spline surfaces along z, where they start, and what lies along, across and between them."""

import pneumorph.kept  # noqa: F401 (before anything of Numba)
from pneumorph.geometry.tube.cover import Cover, build_covers
from pneumorph.geometry.tube.level import Level, build_levels
from pneumorph.geometry.tube.lining import Lining, build_linings
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface, cap_points, enclosed_volume
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.geometry.tube.wedge import Wedge, build_wedges

__all__ = [
    "Cover",
    "Level",
    "Lining",
    "TubeSurface",
    "Wedge",
    "build_covers",
    "build_design_space",
    "build_levels",
    "build_linings",
    "build_wedges",
    "cap_points",
    "enclosed_volume",
    "starting_body",
]
