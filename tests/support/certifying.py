"""Certificates of bodies of tubes that need not be symmetric."""

from pneumorph.limits.of_shape import tube_limits


def certified(body, spec):
    """The certified report of a body against a table of limits."""
    return tube_limits(body, spec).certify(body)
