"""How limits are linearised: samples, the choice of the worst ones, peaks between them, rows of distances."""
