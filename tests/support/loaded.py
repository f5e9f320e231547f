"""A short tube under everything at once."""

import numpy as np

from pneumorph.mechanics import build_loads, build_model, configure
from pneumorph.verify.solids import tube


def loaded_tube(rubber, mixed=False):
    """Its model, its configuration, and unknowns (n,) at random, which are no equilibrium."""
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, rubber, mixed=mixed)
    acting = build_loads(
        built,
        {"A": 0.04},
        acceleration=np.array([9810.0, 0, 0]),
        spring=np.array([0.1, 0.2, 0.5, 3, 20, 7]),
        wrench=np.array([0.01, 0.02, 0.1, 0.1, 0.3, 0.5]),
    )
    vector = 0.05 * np.random.default_rng(0).standard_normal(built.size)
    return built, configure(built, mesh.points, acting), np.where(built.fixed, 0.0, vector)
