"""Settings for the whole suite."""

from pathlib import Path

import jax
import pytest
from hypothesis import settings

# The first call of a compiled kernel takes seconds and says nothing about the property: no deadline for examples.
settings.register_profile("pneumorph", deadline=None)
# For a long run of the properties: pytest tests/fuzz --hypothesis-profile=nightly
settings.register_profile("nightly", deadline=None, max_examples=6000)
settings.load_profile("pneumorph")

MOST_MAPPINGS = 30_000
"""Memory mappings of a process from which on compiled kernels are forgotten; Linux allows 65,530."""


@pytest.fixture(scope="module", autouse=True)
def forgotten_kernels():
    """Compiled kernels go when there are many: those of the whole suite are more than a process can map."""
    yield
    mappings = Path("/proc/self/maps")
    if not mappings.exists() or mappings.read_bytes().count(b"\n") > MOST_MAPPINGS:
        jax.clear_caches()
