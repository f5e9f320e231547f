"""Settings for the whole suite."""

import jax
import pytest
from hypothesis import settings

# The first call of a compiled kernel takes seconds and says nothing about the property: no deadline for examples.
settings.register_profile("pneumorph", deadline=None)
# For a long run of the properties: pytest tests/fuzz --hypothesis-profile=nightly
settings.register_profile("nightly", deadline=None, max_examples=6000)
settings.load_profile("pneumorph")


@pytest.fixture(scope="module", autouse=True)
def forgotten_kernels():
    """Compiled kernels go with the module that used them: those of the whole suite are more than a process can map."""
    yield
    jax.clear_caches()
