"""What a rigid obstacle offers to contact, whether its distance has a formula or it has a surface of triangles."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np

from pneumorph.mechanics.contact.shapes import RigidMesh, Support
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.terms import Values

FORCE, NORMAL, AREA = slice(0, 3), 3, 4
"""What is at which place in the five numbers that a body presses on an obstacle with."""

FULL = 0.95
"""Surface nearer than this share of the activation distance counts in full as area: there it presses by 0.8 % of κ."""


class Floor(Protocol):
    """The barrier of an obstacle on which others rest; registered with JAX."""

    @property
    def center(self) -> Values: ...

    def distance(self, x: Values) -> Values:
        """Distances (...) of places x (..., 3) in mm, as it sees them."""
        ...

    def barrier(self, distance: Values) -> Values:
        """The energy per area at a distance, N/mm."""
        ...


class Obstacle(ABC):
    """A rigid body beside the surface of the model, in its own place; it turns about its centre.

    Its energy is a term of the potential (`energies`) or, where what is near changes with the state, evaluated beside
    the terms (`touch`). All places of nodes (N, 3) are as it sees them, see `pose.py`.

    Attributes
    ----------
    center : (3,) array, mm
    activation : float
        The activation distance d̂, mm.
    touch : function of places, or None
        Its contact with nodes at x (N, 3), as `TriangulatedTouch` has it; None if that is a term.
    floor : Floor or None
        Its barrier, if free obstacles may rest on it.
    """

    center: Values
    activation: float
    touch: Callable[[np.ndarray], Any] | None = None
    floor: Floor | None = None

    def energies(self, number: int, row: int | None) -> Iterable[ElementEnergy]:
        """Its term over the body's surface, if it has one.

        With its row in `Loads.shift` and, if it is free, that of its unknowns.
        """
        return ()

    @abstractmethod
    def pressures(self, places: np.ndarray) -> np.ndarray:
        """What acts on the sample points (F, 7, 3) of the surface: vectors (F, 7, 3) away from it, MPa."""

    @abstractmethod
    def apart(self, x: np.ndarray) -> bool:
        """Whether it does not meet the body, as far as the sample points tell."""

    @abstractmethod
    def free_share(self, start: np.ndarray, end: np.ndarray) -> float:
        """A share of the straight motion of the nodes from `start` to `end` on which no sample point meets it."""

    @abstractmethod
    def pressed(self, x: np.ndarray) -> np.ndarray:
        """The force on it (3,), N, the sum of the normal forces, N, and the area that touches, mm²."""

    @abstractmethod
    def pressed_back(self, x: np.ndarray, bars: np.ndarray) -> np.ndarray:
        """Derivatives (k, N, 3) of cotangents (k, 5) times `pressed` by the places of the nodes."""

    @abstractmethod
    def around(self, sag: float) -> RigidMesh | None:
        """Triangles around it, nowhere farther away than about `sag` in mm; None if it has no end."""

    @abstractmethod
    def support(self, sag: float) -> Support:
        """What of it may touch planes, if it is free."""

    def spin(self) -> np.ndarray:
        """s P (3, 3) in N·mm/rad, see `free.py`."""
        return np.zeros((3, 3))

    def lever(self) -> np.ndarray:
        """From its centre to that of gravity (3,), mm."""
        return np.zeros(3)
