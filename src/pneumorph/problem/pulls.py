"""What of a recorded tension test is its first loading: without unloading, rupture, and what follows a slip."""

from __future__ import annotations

import numpy as np

UNLOADED = 0.8
"""Share of the largest strain of a pull below which later points are taken for unloading."""

JUMP = 0.5
"""Share of the largest strain by which a single step back begins the pull of another specimen."""

DROP = 0.2
"""Share of the stress that is lost from one point to the next, at a larger stretch, where a specimen slips or tears."""

NOISE = 0.1
"""Share of the largest stress below which a drop is noise."""


def first_loadings(stretch: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Which points of a test, in the order of the file, are a first loading, and what was left out, in sentences.

    Parameters
    ----------
    stretch, stress : (n,) arrays
        Of one specimen, or of several one after the other.

    Returns
    -------
    (n,) bool array, list of str
    """
    kept, told = np.ones(len(stretch), bool), []
    back = np.diff(stretch) < -JUMP * (stretch.max() - 1.0)
    for pull in np.split(np.arange(len(stretch)), np.flatnonzero(back) + 1):
        top = int(stretch[pull].argmax())
        if stretch[pull[top:]].min() < 1.0 + UNLOADED * (stretch[pull[top]] - 1.0):
            kept[pull[top + 1 :]] = False
            count = len(pull) - top - 1
            told.append(f"unloading after a stretch of {stretch[pull[top]]:.4g}: {_points(count)} left out")
        loading = pull[: top + 1]
        before, after = stress[loading[:-1]], stress[loading[1:]]
        falls = (after < (1.0 - DROP) * before) & (before > NOISE * stress.max()) & (np.diff(stretch[loading]) >= 0.0)
        if falls.any():
            first = int(np.flatnonzero(falls)[0])
            recovers = stress[loading[first + 1 :]].max() > before[first]
            kept[loading[first + 1 :]] = False
            what = "slips in its grips" if recovers else "tears"
            told.append(
                f"the stress falls from {before[first]:.3g} to {after[first]:.3g} MPa at a stretch of "
                f"{stretch[loading[first]]:.4g}, as where the specimen {what}: "
                f"{_points(len(loading) - first - 1)} from there on left out"
            )
    return kept, told


def _points(count: int) -> str:
    return "1 point" if count == 1 else f"{count} points"
