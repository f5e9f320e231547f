"""The limits of a design: what they measure, their linearisations for the optimiser, and their certificate."""

import pneumorph.kept
import pneumorph.numerics  # noqa: F401 (before anything of jax)
