"""What a design is judged by: features of the deformed body, and functions of them to be minimised."""

from pneumorph.objective.features import Features, features
from pneumorph.objective.motion import Objective, maximize

__all__ = ["Features", "Objective", "features", "maximize"]
