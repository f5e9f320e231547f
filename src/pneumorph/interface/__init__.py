"""The public functions, which `pneumorph` offers under its own name: designs, runs, sweeps and checks."""
