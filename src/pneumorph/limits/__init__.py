"""The limits of a design: what they measure, their linearisations for the optimiser, and their certificate."""

import pneumorph.kept  # noqa: F401 (before anything of Numba)
import pneumorph.numerics  # noqa: F401 (before anything of jax)
