"""From exact surfaces to quadratic tetrahedra that follow them."""
