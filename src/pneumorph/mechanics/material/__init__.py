"""Rubbers: their energies ψ(F), and how the parameters are fitted to tests."""
