"""Sweeps of bodies of rubber that remembers: what a step finds depends on the steps before it and on its duration.

In each step the rubber has a potential, whose data at the quadrature points are those of the last solution
(`material/memory.py`), so that every step is solved as any other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from pneumorph.mechanics.assembly.build import with_groups
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.element import mixed
from pneumorph.mechanics.elements.kinematics import State, deformation_gradients
from pneumorph.mechanics.elements.solid import Remembering
from pneumorph.mechanics.elements.terms import Connectivity
from pneumorph.mechanics.material.memory import Memory, Past, after, at_rest, in_step, step_of
from pneumorph.mechanics.material.rubber import complete
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium
from pneumorph.mechanics.solve.sweep import sweep

Pasts = Mapping[str, Past]
"""Of the quadrature points (4, E) of regions whose rubber remembers."""


def sweep_with_memory(
    path: Iterable[Configuration], durations: Iterable[float], tangent: Tangent
) -> Iterator[tuple[Configuration, Equilibrium | NoEquilibrium]]:
    """The equilibrium of every configuration of a sweep, each reached from the one before in a duration in s.

    Yields each configuration with the potential of its step. The body has rested before the first one, or for long
    under its loads where the first duration is infinite. Parameters are those of `sweep.sweep`, and the durations.
    """
    steps, taken = iter(zip(path, durations, strict=True)), list[tuple[Configuration, float]]()
    pasts: Pasts | None = None

    def configurations() -> Iterator[Configuration]:
        for at, duration in steps:
            model = with_memory(at.model, rested(at.model) if pasts is None else pasts, duration)
            taken[:] = [(replace(at, model=model), duration)]
            yield taken[0][0]

    # The sweep asks for a configuration when the one before has been solved, and its past is known.
    for found in sweep(configurations(), tangent):
        here, duration = taken[0]
        if isinstance(found, Equilibrium):
            pasts = past_after(here, found.state, rested(here.model) if pasts is None else pasts, duration)
        yield here, found


def rested(model: Model) -> Pasts:
    """The pasts of a body at rest."""
    return {
        name: at_rest(memory, (4, len(model.regions[name])))
        for name, rubber in model.rubbers.items()
        if (memory := rubber.memory) is not None
    }


def with_memory(model: Model, pasts: Pasts, duration: float) -> Model:
    """The model with the potential of a step; a `Tangent` of the model serves it too.

    Parameters
    ----------
    model : Model
    pasts : Pasts
    duration : float
        Of the step, s.
    """
    groups, regions = [], iter(model.rubbers.items())
    for group in model.potential.groups:
        if any(energy.of_rubber for energy in group.energies):
            name, rubber = next(regions)
            if (memory := rubber.memory) is not None:
                elements, energy = _of_step(group.connectivity, memory, model.mixed, pasts[name], duration)
                kept = (energy if each.of_rubber else each for each in group.energies)
                group = group._replace(connectivity=elements, energies=tuple(kept))
        groups.append(group)
    return with_groups(model, groups)


def _of_step(
    elements: Connectivity, memory: Memory, are_mixed: bool, past: Past, duration: float
) -> tuple[Connectivity, Remembering]:
    """The elements of a region with its past, and their energy."""
    share, held = step_of(memory, past, duration)
    points = np.concatenate([held, past.worst[None]]).transpose(2, 0, 1).reshape(elements.count, -1)
    padding = np.repeat(points[:1], len(elements.nodes) - elements.count, axis=0)
    density = (mixed if are_mixed else complete)(in_step(memory.isochoric))
    own = np.array(memory.parameters), np.asarray(share), np.array(memory.softening)
    return replace(elements, data=np.concatenate([points, padding])), Remembering(density, *own)


def past_after(at: Configuration, state: State, pasts: Pasts, duration: float) -> Pasts:
    """The pasts after a step that ends in a state.

    Parameters
    ----------
    at : Configuration
    state : State
        Its equilibrium.
    pasts : Pasts
        Before it.
    duration : float
        Of the step, s.
    """
    model = at.model
    F = deformation_gradients(model.tets.nodes[: model.elements], at.X, displacement(model.tip, at.X, state))
    known = {name: rubber.memory for name, rubber in model.rubbers.items()}
    return {
        name: after(memory, past, F[..., model.regions[name]], duration)
        for name, past in pasts.items()
        if (memory := known[name]) is not None
    }
