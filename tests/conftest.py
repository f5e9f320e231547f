"""Settings for the whole suite."""

from hypothesis import settings

# The first call of a compiled kernel takes seconds and says nothing about the property: no deadline for examples.
settings.register_profile("pneumorph", deadline=None)
settings.load_profile("pneumorph")
