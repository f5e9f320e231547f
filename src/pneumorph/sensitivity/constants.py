"""First derivatives by the parameters of rubbers, such as the coefficients of their energies: from adjoints alone.

The parameters θ enter Π by ψ(F, π, θ). With the adjoint w of what is measured, its derivative by one of them is
−wᵀ∂R/∂θ, and ∂R/∂θ are the forces of a solid whose energy is ∂ψ/∂θ, which JAX derives from ψ.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics import Configuration, State
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.potential import forces, grouped
from pneumorph.mechanics.elements.energy import Term
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.material.energies import along_parameters


def parameter_forces(at: Configuration, state: State) -> dict[str, np.ndarray]:
    """What the forces R change by per unit of every parameter of every rubber.

    Parameters
    ----------
    at, state : the equilibrium.

    Returns
    -------
    {region: (m, n)}
        For the m parameters of its rubber, on all n unknowns.
    """
    model, nodes = at.model, Displacement(at.model.potential.tip, at.X, state)
    alone, found = model.potential._replace(contact=None), {}
    solids = [(elements, energy) for elements, energy in model.terms if isinstance(energy, Solid)]
    for name, (elements, solid) in zip(model.rubbers, solids, strict=True):
        density, own = along_parameters(solid.energy_density), np.asarray(solid.parameters)
        changed = [Term(elements, Solid(density, np.stack([own, unit]))) for unit in np.eye(len(own))]
        states = [nodes.on_unknowns(forces(alone, grouped([term]), nodes, at.loads)[1]) for term in changed]
        found[name] = np.array([model.vector(each) for each in states])
    return found
