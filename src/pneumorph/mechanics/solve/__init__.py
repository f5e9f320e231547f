"""Equilibria of Π: where they are, whether they are stable, and how they move with loads and shape."""
