"""Settings for the whole suite."""

import gc
import os
from functools import cache
from itertools import count
from pathlib import Path

import jax
import numpy as np
import pytest
import typer.testing
from compiling import share_kernels
from hypothesis import settings
from meshing import share_meshes

from pneumorph import threads

# As the command does.
gc.set_threshold(20_000, 50)
# The first call of a compiled kernel takes seconds and says nothing about the property: no deadline for examples.
settings.register_profile("pneumorph", deadline=None)
# For a long run of the properties: pytest tests/fuzz --hypothesis-profile=nightly
settings.register_profile("nightly", deadline=None, max_examples=6000)
settings.load_profile("pneumorph")

MOST_MAPPINGS = 30_000
"""Memory mappings of a process from which on compiled kernels are forgotten; Linux allows 65,530."""


PLACES = count()


def _configured(monkeypatch, tmp_path_factory):
    place = tmp_path_factory.getbasetemp() / "configuration" / str(next(PLACES))
    for name in ("XDG_CONFIG_HOME", "WIN_PD_OVERRIDE_APPDATA"):
        monkeypatch.setenv(name, str(place))


@pytest.fixture(scope="session", autouse=True)
def no_configuration_of_the_user(tmp_path_factory):
    """The user's configuration is neither read nor written."""
    with pytest.MonkeyPatch.context() as patch:
        _configured(patch, tmp_path_factory)
        yield


@pytest.fixture(scope="session", autouse=True)
def kernels_of_all_processes(tmp_path_factory):
    """Processes that run tests beside each other share what they compile."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        share_kernels(tmp_path_factory.getbasetemp().parent / "kernels")


@pytest.fixture(scope="session", autouse=True)
def meshes_are_filled_once(tmp_path_factory):
    """Hundreds of tests are about a few small bodies."""
    own = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        share_meshes((own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "meshes", patch)
        yield


@pytest.fixture(scope="session", autouse=True)
def commands_are_built_once():
    """Typer's runner would build all commands from their signatures for each call, which takes longer than most do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.testing, "_get_command", cache(typer.main.get_command))
        yield


@pytest.fixture(autouse=True)
def configuration_of_its_own(monkeypatch, tmp_path_factory):
    """What one test trusts is new to the next."""
    _configured(monkeypatch, tmp_path_factory)


@pytest.fixture(scope="module", autouse=True)
def forgotten_kernels():
    """Compiled kernels go when there are many: those of the whole suite are more than a process can map."""
    yield
    mappings = Path("/proc/self/maps")
    if not mappings.exists() or mappings.read_bytes().count(b"\n") > MOST_MAPPINGS:
        jax.clear_caches()


@pytest.fixture
def three_threads(monkeypatch):
    """Three threads for kernels, however many the tests have."""
    monkeypatch.setattr(threads.numba, "get_num_threads", lambda: 3)
    threads._workers.cache_clear()
    yield
    threads._workers().shutdown()
    threads._workers.cache_clear()


@pytest.fixture(scope="module")
def unoptimised():
    """For modules that compile more than they compute: jax compiles in half of the time, what runs slower."""
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)
    # Else the modules after it would compute with them.
    jax.clear_caches()


@pytest.fixture(scope="module")
def without_mesh_errors():
    """For modules that simulate and do not ask how far meshes are off, which takes longer than the states do."""
    # Loaded here, as most modules do not simulate.
    from pneumorph.analysis import simulate

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulate, "refined_model", lambda *_: None)
        yield


@pytest.fixture
def drawn(monkeypatch):
    """The jobs that VTK was given, which are drawn as grey pictures."""
    # Loaded here: most modules draw nothing.
    from pneumorph.output import render

    jobs = []

    def images(job):
        jobs.append(job)
        sizes = [np.ptp(panel.extent.reshape(2, 2), axis=1) for panel in job.panels]
        return [np.full((int(job.dots * high), int(job.dots * wide), 4), 128, np.uint8) for wide, high in sizes]

    monkeypatch.setattr(render, "images", images)
    return jobs
