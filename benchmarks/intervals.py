"""Whether intervals of `calibrate` contain the truth: python benchmarks/intervals.py [--curves 100] [--noise 0.02]
                                                       [--fit modulus,pressure]

Curves of a coarse bending body with the parameters of its problem, with independent normal errors. Modulus and
pressure, or what is named, constants of a Yeoh rubber too, are fitted to every curve by the steps of `calibrate`, which
begin at the truth, since where least squares end does not depend on where they begin
(tests/analysis/test_calibration.py has steps from 15 % away). Intervals of 95 % are counted that contain the truth, and
estimates within two standard deviations of it by the noise that was given.
"""

import argparse
from dataclasses import replace

import numpy as np

import pneumorph as pm
from pneumorph.analysis.along import Curve
from pneumorph.analysis.calibration import PARAMETERS, UNITS, _Fit, fitted, is_constant
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads

RUBBERS = {
    "neo-hookean": 'shear_modulus = "40 kPa"',
    "yeoh": 'coefficients = ["20 kPa", "10 kPa"]',
}
TEXT = """
[material]
name = "soft silicone"
model = "{model}"
{parameters}
bulk_modulus = "2 MPa"
density = "1.07 g/cm^3"
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
pressure = {{ A = "12 kPa", B = "0 kPa" }}
objective = {{ motion = "bending_y" }}
"""

POINTS, MOST = 6, 0.024
"""Points of a curve, and their largest pressure, MPa."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--curves", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.02, help="standard deviation over the largest motion")
    parser.add_argument("--fit", default="modulus,pressure", help="what is fitted, as of pneumorph calibrate")
    given = parser.parse_args()
    names = tuple(given.fit.split(","))
    model = "yeoh" if any(map(is_constant, names)) else "neo-hookean"
    problem: pm.Problem = loads(TEXT.format(model=model, parameters=RUBBERS[model]))
    pressures = np.outer(np.linspace(MOST / POINTS, MOST, POINTS), [1.0, 0.0])
    fit = _Fit.of(
        problem, starting_body(problem.tubes), problem.task[0], Curve(pressures, "bending_y", np.zeros(POINTS)), names
    )
    truth = fit.begun()
    curve, deviation = truth.values, given.noise * np.abs(truth.values).max()
    slopes = truth.slopes(names) * [UNITS[PARAMETERS.get(name, "%")] for name in names]
    known = deviation * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    told = ", ".join(f"{name} {size:.2g} {PARAMETERS.get(name, '%')}" for name, size in zip(names, known, strict=True))
    print(f"bending {np.degrees(curve)[[0, -1]].round(2)} degrees; standard deviations: {told}", flush=True)
    inside, near = np.zeros(len(names), dtype=int), np.zeros(len(names), dtype=int)
    spent = fit.tangent.factorisations
    for number, errors in enumerate(deviation * np.random.default_rng(0).standard_normal((given.curves, POINTS)), 1):
        found = fitted(replace(fit, curve=Curve(pressures, "bending_y", curve + errors)), names, truth)
        inside += np.abs(found.values) <= found.half
        near += np.abs(found.values) <= 2.0 * known
        if number % 10 == 0 or number == given.curves:
            told = "; ".join(
                f"{name} in {within} intervals, within 2 σ in {close}"
                for name, within, close in zip(names, inside, near, strict=True)
            )
            expected = f"{0.95 * number:g} ± {np.sqrt(number * 0.95 * 0.05):.1f} are expected"
            each = (fit.tangent.factorisations - spent) / number
            print(f"of {number} curves: {told}; {expected}; {each:.0f} factorisations each", flush=True)


if __name__ == "__main__":
    main()
