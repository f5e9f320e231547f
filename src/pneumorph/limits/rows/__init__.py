"""How limits are linearised: what a body is asked for at its samples, and rows of what is found there."""
