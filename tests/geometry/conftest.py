from types import SimpleNamespace

import pytest


@pytest.fixture
def spec():
    """Bodies with two chambers, one flat and one with poles, the ripple optional."""

    def make(ripple=None, length=80.0, radius=8.0):
        return SimpleNamespace(
            length=length,
            radius=radius,
            control_density=0.6,
            ripple=ripple and SimpleNamespace(amplitude=ripple[0], period=ripple[1]),
            chamber=(
                SimpleNamespace(name="A", radius=4.0, center=(0.0, 0.0), span=(3.0, length - 3.0), ends="flat"),
                SimpleNamespace(name="B", radius=3.0, center=(1.0, 2.0), span=(10.0, length - 30.0), ends="pole"),
            ),
        )

    return make
