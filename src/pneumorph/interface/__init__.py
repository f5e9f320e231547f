"""The public interface, available as names of `pneumorph` itself: designs, runs, sweeps and checks."""
