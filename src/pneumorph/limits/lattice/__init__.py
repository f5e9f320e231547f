"""Limits on bodies from files: triangles of their faces as lattices displace them, and what encloses these."""
