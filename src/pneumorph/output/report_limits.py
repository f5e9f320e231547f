"""How much of the nearest limit the designs of a page use."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import numpy as np

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.shares import NAMES, Usage
from pneumorph.limits.table import BY_NAME
from pneumorph.output.packed import Steps, in_steps
from pneumorph.output.report_shapes import array_key

STEP = 0.01
"""Step of shares."""

MOST = 1.27
"""Larger shares are stored as this one: what one byte holds."""

Known = dict[bytes, list[Usage]]
"""The usage of bodies by a digest of their control points."""


def packed_usage(
    limits: ShapeLimits, bodies: Sequence[Body], known: Known | None = None
) -> tuple[dict[str, Any], dict[str, Steps]]:
    """The names of limits as a page needs them, and shares and limits of every surface, (designs, ...) as `Usage`.

    What is in `known` is not computed again, and what is computed is added to it.
    """
    known = {} if known is None else known
    usages = []
    with doing("measuring the limits") as far:
        for number, body in enumerate(bodies):
            far(f"{number} of {len(bodies)} designs")
            digest = blake2b(np.asarray(body.control_points()).tobytes(), digest_size=16).digest()
            if digest not in known:
                known[digest] = limits.shares(body)
            usages.append(known[digest])
    words, arrays = [BY_NAME[name].word for name in NAMES], {}
    for number, surface in enumerate(bodies[0].surfaces):
        key = array_key(surface)
        shares = np.array([each[number].share for each in usages])
        arrays[f"used {key}"] = in_steps(np.minimum(shares, MOST), STEP, differences=True)
        arrays[f"limit {key}"] = Steps(np.array([each[number].limit for each in usages]))
    return {"limit_words": words}, arrays
