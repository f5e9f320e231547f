"""Fast models of a body: its pose, volumes and stiffness as polynomials of the pressures, fitted to exact states."""
