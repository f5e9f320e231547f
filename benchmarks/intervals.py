"""Whether intervals of `calibrate` contain the truth: python benchmarks/intervals.py [--curves 100] [--noise 0.02]

Curves of a coarse bending body, computed with moduli that are 15 % larger and a pressure that is 1 kPa larger than
those of the problem, with independent normal errors. Every curve is fitted from the problem's parameters by the steps
of `calibrate`. A share of 95 % of the intervals is to contain the truth; of 100 independent ones 93 or more do so with
a probability of 87 %.
"""

import argparse
from dataclasses import replace

import numpy as np

import pneumorph as pm
from pneumorph.analysis.calibration import Curve, _Fit, fitted
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads

TEXT = """
[material]
name = "Hei-Cast 8400"
[body]
length = "24 mm"
radius = "10 mm"
[[body.chamber]]
name = "A"
center = ["5 mm", "0 mm"]
radius = "3 mm"
span = ["3 mm", "21 mm"]
[[body.chamber]]
name = "B"
center = ["-5 mm", "0 mm"]
radius = "3 mm"
span = ["3 mm", "21 mm"]
[limits]
wall = "1 mm"
[mesh]
size = "8 mm"
element = "quadratic"
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "bend"
pressure = { A = "12 kPa", B = "0 kPa" }
objective = { motion = "bending_y" }
"""

TRUTH = {"modulus": 15.0, "pressure": 1.0}
"""In the units of `calibrate`: per cent and kPa."""

POINTS = 6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--curves", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.02, help="standard deviation over the largest motion")
    given = parser.parse_args()
    problem: pm.Problem = loads(TEXT)
    pressures = np.outer(np.linspace(0.01, 0.06, POINTS), [1.0, 0.0])
    fit = _Fit.of(
        problem, starting_body(problem.tubes), problem.task[0], Curve(pressures, "bending_y", np.zeros(POINTS))
    )
    here = fit.begun()
    there = fit.moved(here, np.array([0.15, 0.0, 0.001]))
    if there is None:
        raise SystemExit("no state with the true parameters")
    curve, names = there.values, list(TRUTH)
    noise = given.noise * np.abs(curve).max() * np.random.default_rng(0).standard_normal((given.curves, POINTS))
    within = np.zeros(2, dtype=int)
    for number, errors in enumerate(noise, start=1):
        own = replace(fit, curve=Curve(pressures, "bending_y", curve + errors))
        found = fitted(own, names, here)
        within += np.abs(found.values - list(TRUTH.values())) <= found.half
        if number % 10 == 0 or number == given.curves:
            told = ", ".join(f"{name} in {count}" for name, count in zip(names, within, strict=True))
            print(f"of {number} curves with noise of {100 * given.noise:g} %: {told}", flush=True)


if __name__ == "__main__":
    main()
