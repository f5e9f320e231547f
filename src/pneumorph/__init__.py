"""pneumorph: automatic morphological design of pneumatic soft robots."""

import jax

# Equilibria are solved to nine digits and gradients checked to eight: single precision cannot.
jax.config.update("jax_enable_x64", True)

__version__ = "0.1.0"
