"""Checks across tables: whether the parts of a problem are consistent with each other."""
