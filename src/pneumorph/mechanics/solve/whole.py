"""The whole body that the model of its part represents.

The model of a part has symmetric motions only. Stability against all other motions follows from the tangent of the
whole body, factorised once at the unfolded state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.build import build_model
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.border import negative_motions
from pneumorph.mesh import TetMesh, Unfolded, unfold


@dataclass(frozen=True, eq=False)
class Whole:
    """The whole body that the model of a part represents."""

    part: Model
    image: Unfolded
    model: Model
    tangent: Tangent

    def configuration(self, at: Configuration) -> Configuration:
        """The whole body at the nodes of the part, under the full loads."""
        pressure = dict(zip(self.part.chambers, at.loads.pressure, strict=True))
        loads = at.loads._replace(
            pressure=np.array([pressure[name] for name in self.model.chambers]),
            spring=self.part.copies * at.loads.spring,
            wrench=self.part.copies * at.loads.wrench,
        )
        return Configuration(self.model, self.image.vectors(at.X), loads, at.blocked, at.enclosed)

    def state(self, part: State) -> State:
        """The symmetric state of the whole body, from the state of its part."""
        own = np.array(part.u)
        self.part.tip.tied.led(own)
        u = self.image.vectors(own)
        if not self.part.mixed:
            return State(u, part.plate)
        count = len(self.part.rubbers)
        hydrostatic = part.hydrostatic.reshape(count, -1)[:, self.part.source[self.image.source]]
        return State(u, part.plate, hydrostatic.ravel())

    def negative_pivots(self, at: Configuration, state: State) -> int:
        """Negative pivots of the whole body at a state of the part; 0 means stable against all motions."""
        there, whole = self.configuration(at), self.state(state)
        self.tangent.factorise(there, whole)
        return negative_motions(there, self.tangent, whole)


def whole_of(part: Model, mesh: TetMesh) -> Whole:
    """The whole body of the model of a part and its mesh."""
    image = unfold(mesh)
    rubber = part.rubber if len(part.rubbers) == 1 else part.rubbers
    contact = None
    if part.contact is not None:
        surface = surface_of(image.mesh)
        own = None if part.contact.own is None else part.contact.own.of_whole(surface, image.mesh.points)
        contact = Contact(surface, {}, {}, own)
    body = build_model(
        image.mesh,
        rubber,
        part.plate,
        mixed=part.mixed,
        weight=part.weight,
        contact=contact,
        reinforcements=part.reinforcements,
    )
    return Whole(part, image, body, Tangent(body))
