"""Every published measurement beside its prediction, in one table: python benchmarks/validate.py [--size 10]

Of each curve the root mean square of the differences, the same over the largest measured value, the measured scatter,
and for the beam how far the mesh is off. Rubbers are those of tests without the body; what is fitted is named. The
curves themselves are printed by measured.py and measured_disc.py.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import measured as beam
import measured_disc as disc
import numpy as np

HEAD = "| body | rubber | curve | points | RMSE | over the largest | scatter of the measurement | mesh |"


def row(*words: str, predicted: np.ndarray, seen: np.ndarray, scatter: float, unit: str, mesh: str) -> str:
    """A line of the table.

    Parameters
    ----------
    words : body, rubber and curve.
    predicted, seen : (n,) in a unit.
    scatter : of the measured values, in that unit.
    unit : of all of them.
    mesh : what is known of its error.
    """
    rms = float(np.sqrt(np.mean((predicted - seen) ** 2)))
    share = f"{100 * rms / np.abs(seen).max():.0f} %"
    return "| " + " | ".join([*words, f"{len(seen)}", f"{rms:.3g} {unit}", share, f"{scatter:.2g} {unit}", mesh]) + " |"


def of_beam(folder: Path, size: float = 8.0) -> Iterator[str]:
    """The beam with the rubber of a first pull, and with the one that its own weight alone tells."""
    known = beam.measured()
    beam.write(folder)
    own = beam.from_own_weight(folder, known["gravity"][0], size)
    rubbers = {f"first pull, {beam.FIRST_PULL:.0f} kPa": (beam.FIRST_PULL, list(beam.CASES))}
    rubbers["its authors', fitted to 101 g, 87.9 kPa"] = (87.9, ["gravity", "load52"])
    rubbers[f"own weight, {own:.1f} kPa"] = (own, ["load52", "load101"])
    for name, (modulus, cases) in rubbers.items():
        found = [beam.predicted(folder, modulus, beam.CASES[case], size) for case in cases]
        values, off = np.array(found).T
        seen, half = np.array([known[case] for case in cases]).T
        loads = ", ".join(f"{case.removeprefix('load')} g".replace("gravity", "0") for case in cases)
        words = ("beam", name, f"deflection with {loads}")
        yield row(*words, predicted=values, seen=seen, scatter=half.mean(), unit="mm", mesh=f"± {off.max():.1f} mm")


def of_disc(folder: Path, size: float, loads: list[float]) -> Iterator[str]:
    """The disc without rings, at all heights of the comparison that the path reaches."""
    known, spread = disc.measured(), disc.measured("pressure_sd_Pa")
    for name, force in ((name, force) for name in disc.RUBBERS for force in loads):
        heights, pressures, _ = disc.predicted(folder, disc.Disc(), name, force, size, min(60.0, max(known[force])))
        at = [h for h in disc.HEIGHTS if h in spread[force] and len(heights) and heights[0] <= h <= heights[-1]]
        if not at:
            continue
        seen, scatter = (np.array([table[force][each] for each in at]) for table in (known, spread))
        there = np.interp(at, heights, pressures)
        words = ("disc", name, f"pressure under {force} N")
        yield row(*words, predicted=there, seen=seen, scatter=scatter.mean(), unit="kPa", mesh=f"{size:g} mm")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=float, default=10.0, help="of the disc's elements, mm")
    parser.add_argument("--loads", type=float, nargs="*", default=disc.FORCES, help="on the disc, N")
    given = parser.parse_args()
    print(f"{HEAD}\n|{'---|' * HEAD.count(' | ')}---|")
    with tempfile.TemporaryDirectory() as name:
        for line in of_beam(Path(name)):
            print(line, flush=True)
        for line in of_disc(Path(name), given.size, given.loads):
            print(line, flush=True)


if __name__ == "__main__":
    main()
