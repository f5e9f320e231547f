"""Places where limits are not certified to be satisfied."""
