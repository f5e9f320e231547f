"""Bodies to start from: each function here gives a `Start`, which writes a problem and the CAD file of its body.

Sizes are lengths with units, as text or as pint quantities; those that are left out have a default. Walls, gaps and
channels are at least 0.8 mm, so that they can be cast in silicone.

>>> import pneumorph as pm
>>> str(pm.bodies.dome(radius="15 mm").write("lift"))
'lift.toml'
"""

from pneumorph.bodies.bellows import bellows
from pneumorph.bodies.cup import cup
from pneumorph.bodies.dome import dome
from pneumorph.bodies.fast_pneunet import fast_pneunet
from pneumorph.bodies.half_round import half_round
from pneumorph.bodies.hand import hand
from pneumorph.bodies.pneunet import pneunet
from pneumorph.bodies.start import Start

__all__ = ["Start", "bellows", "cup", "dome", "fast_pneunet", "half_round", "hand", "pneunet"]
