"""`pneumorph warm-up`: compile, once after the installation, what would be compiled when bodies are first designed."""

from __future__ import annotations

from contextlib import suppress
from subprocess import TimeoutExpired

import numpy as np

from pneumorph.analysis import analyse_body, run_gradient_check
from pneumorph.doing import doing
from pneumorph.interface.design import starting_design
from pneumorph.interface.runs import design
from pneumorph.mesh import Morph, relax, slide
from pneumorph.numerics import cache_folder
from pneumorph.optimize.setup import Setup, build_setup
from pneumorph.problem import Problem, loads
from pneumorph.problem.starts import text_of
from pneumorph.processes import program, python, temporary_folder, wait

CURVED = "0.04 /mm^2"
"""A limit that the start is within 3 % of, as later designs are: only there is curvature measured between samples, by
kernels of which a first design would wait 4 s."""

SHORT = {
    "body.length": "24 mm",
    "body.chamber[0].span": ["3 mm", "21 mm"],
    "body.control_density": "0.4 /mm",
    "limits.curvature": CURVED,
    "mesh.size": "5 mm",
    "optimizer.iterations": 1,
}
"""What makes the extending tube that `new` writes small: kernels are those of any size."""


DENT = 0.2
"""Of its surfaces, mm, so that limits are violated."""

_CHILD = "from pneumorph.cli.warm_up import compile_limits; compile_limits()"

_MOST = 600.0
"""Seconds for which the other process is waited for; what it has not compiled by then is compiled here."""


def warm_up() -> None:
    """Check a small tube and design it once with each kind of elements, in a folder that is removed.

    Two thirds of what is compiled is for limits. A second process compiles what measures them, while this one compiles
    their certificates, which come last there, and then the elements.
    """
    with temporary_folder() as folder, program(python("-c", _CHILD)) as other:
        kinds = {element: small(element) for element in ("quadratic", "mixed")}
        with doing("certifying the limits of a small tube"):
            _ = starting_design(kinds["quadratic"]).limits
        for element, asked in kinds.items():
            with doing(f"checking a small tube of {element} elements"):
                run_gradient_check(analyse_body(asked, starting_design(asked).body))
        with doing("measuring the limits of a small tube"), suppress(TimeoutExpired):
            wait(other, _MOST)
        for element, asked in kinds.items():
            with doing(f"designing a small tube of {element} elements"):
                design(asked, folder / element)
    print(f"most of what checks and designs of tubes need is compiled; jax's part is in {cache_folder()}")


def compile_limits() -> None:
    """What the second process does: a dented tube is brought within its limits, a twisted mesh is made sound."""
    setup = build_setup(small("quadratic"))
    dent = np.where(np.arange(setup.space.n) % 7, 0.0, DENT)
    setup.within(setup.space.start + dent)
    for better in (relax, slide):
        better(*twisted(setup))


def twisted(setup: Setup) -> tuple[Morph, np.ndarray]:
    """The mesh of a tube, and its control points turned to and fro along it, at which elements are poor."""
    body = setup.space.body(setup.space.start)
    points = body.control_points()
    places = (points[:, 0] + 1j * points[:, 1]) * np.exp(1j * np.sin(0.3 * points[:, 2]))
    return setup.discretise(body, 0.0).morph, np.column_stack([places.real, places.imag, points[:, 2]])


def small(element: str) -> Problem:
    """An extending tube that takes seconds."""
    return loads(text_of("extension")).with_changes(SHORT | {"mesh.element": element})
