"""Files of bodies from files: their own CAD faces, displaced as designs displace them, and triangles of these."""
