"""Measured bodies beside their predictions, with the error bars of both."""

from pneumorph.validation.comparison import Comparison
from pneumorph.validation.curve import compared
from pneumorph.validation.suite import BODIES, published

__all__ = ["BODIES", "Comparison", "compared", "published"]
