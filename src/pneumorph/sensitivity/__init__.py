"""How an objective depends on the shape and the pressures: the exact discrete gradient, the paper's boundary formula, and Taylor tests."""

from pneumorph.sensitivity.adjoint import NodalGradient, gradient
from pneumorph.sensitivity.boundary import boundary_gradient
from pneumorph.sensitivity.taylor import TaylorTest, taylor_test

__all__ = ["NodalGradient", "TaylorTest", "boundary_gradient", "gradient", "taylor_test"]
