"""`pneumorph warm-up`: compile, once after the installation, what would be compiled when bodies are first designed."""

from __future__ import annotations

from pneumorph.analysis import analyse_body, run_gradient_check
from pneumorph.doing import doing
from pneumorph.interface.design import starting_design
from pneumorph.interface.runs import design
from pneumorph.numerics import cache_folder
from pneumorph.problem import Problem, loads
from pneumorph.problem.starts import text_of
from pneumorph.processes import temporary_folder

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


def warm_up() -> None:
    """Check a small tube and design it once with each kind of elements, in a folder that is removed."""
    with temporary_folder() as folder:
        for element in ("quadratic", "mixed"):
            asked = small(element)
            start = starting_design(asked)
            with doing(f"checking a small tube of {element} elements"):
                _ = start.limits
                run_gradient_check(analyse_body(asked, start.body))
            with doing(f"designing a small tube of {element} elements"):
                design(asked, folder / element)
    print(f"most of what checks and designs of tubes need is compiled; jax's part is in {cache_folder()}")


def small(element: str) -> Problem:
    """An extending tube that takes seconds."""
    return loads(text_of("extension")).with_changes(SHORT | {"mesh.element": element})
