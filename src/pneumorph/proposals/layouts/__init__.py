"""Layouts: one chamber or several, plain, with threads, wound, of other sections, or rows on a floor."""

from pneumorph.proposals.layouts.layout import Drawn, Draws, Layout, NoRoom
from pneumorph.proposals.layouts.profiles import PROFILE, SHEET
from pneumorph.proposals.layouts.rows import ROWS
from pneumorph.proposals.layouts.several import ALONG, AROUND, SEGMENTS
from pneumorph.proposals.layouts.single import BESIDE_AXIS, CENTRAL, THREADS
from pneumorph.proposals.layouts.wound import HELIX, WOUND

_IN_TUBES = (CENTRAL, BESIDE_AXIS, THREADS, *AROUND, ALONG, SEGMENTS, WOUND, HELIX)
LAYOUTS: tuple[Layout, ...] = (*_IN_TUBES, PROFILE, SHEET, *ROWS)
"""All of them."""

__all__ = ["LAYOUTS", "Drawn", "Draws", "Layout", "NoRoom"]
