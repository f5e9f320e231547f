"""Limits near a design, as the optimiser sees them: rows c + J dP ≤ 0, or smooth functions of the control points."""
