"""Cost of the limits over the number of control points: value and gradient, search for close pairs, certificate.

Run `python benchmarks/limits.py`; it prints a table.
"""

import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.geometry.tube.start import starting_body
from pneumorph.limits.of_shape import build_limit_functions, tube_limits
from pneumorph.problem import BodySpec, Limits

DENSITIES = (0.22, 0.4, 0.6, 0.9, 1.27)  # control points per mm: 1k to 30k variables


def milliseconds(run: Callable[[], object], repeat: int) -> float:
    """Median time of several runs, after one that compiles."""
    run()
    taken = []
    for _ in range(repeat):
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return 1e3 * float(np.median(taken))


def costs(density: float, spec: Limits) -> tuple[int, int, float, float, float]:
    """Numbers of control points and samples; ms for value and gradient, and for the pair search; s for the report."""
    table = {
        "length": "80 mm",
        "radius": "8 mm",
        "control_density": f"{density} /mm",
        "ripple": {"amplitude": "1.5 mm", "period": "10 mm"},
        "chamber": [{"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "77 mm"]}],
    }
    body = starting_body(BodySpec.model_validate(table))
    certificates = tube_limits(body, spec)
    limits = build_limit_functions(body, spec)
    points = jnp.asarray(body.control_points())
    partners = jax.device_put(limits.partners(points))

    def penalty(points, partners):
        return sum(jnp.mean(jnp.maximum(c + 1.0, 0.0) ** 2) for c in limits.values(points, partners).values())

    value_and_gradient = jax.jit(jax.value_and_grad(penalty))
    return (
        len(points),
        sum(len(grid.q) * len(grid.r) for grid in limits.grids),
        milliseconds(lambda: jax.block_until_ready(value_and_gradient(points, partners)), 30),
        milliseconds(lambda: limits.partners(points), 3),
        1e-3 * milliseconds(lambda: certificates.certify(body), 3),
    )


def main() -> None:
    spec = Limits.model_validate({"envelope": {"radius": "12 mm"}})
    print(f"{'points':>9} {'samples':>8} {'value+gradient':>15} {'pairs':>9}    (ms) {'certificate':>12}   (s)")
    for density in DENSITIES:
        print("{:9d} {:8d} {:15.1f} {:9.0f}        {:12.2f}".format(*costs(density, spec)))


if __name__ == "__main__":
    main()
