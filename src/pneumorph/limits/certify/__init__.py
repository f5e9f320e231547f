"""How limits are certified: what a body is asked for, and the worst values and places that are collected from it."""
