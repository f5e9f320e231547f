"""pneumorph: automatic morphological design of pneumatic soft robots."""

import os

# Worker threads of the linear solver that spin while they wait take the cores from the kernels in between: measured
# twice as slow.
os.environ.setdefault("KMP_BLOCKTIME", "0")
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import jax

# Equilibria are solved to nine digits and gradients checked to eight: single precision cannot.
jax.config.update("jax_enable_x64", True)

__version__ = "0.1.0"
