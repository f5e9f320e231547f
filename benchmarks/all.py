"""Run the benchmarks and write docs/performance.md: python benchmarks/all.py --quick|--full RUNS [--only TITLE …].

RUNS is a folder with finished runs of the examples, by the name of their files (linear, arm_planar, …); those that are
not there are left out of the tables. Runs of the paper's cases (paper_size) and of denser nets (denser) that are
finished there are not run again: remove them to measure them anew. Every section is the output of one benchmark of
this folder, run by itself; one that fails leaves its last line. `--quick` takes about a quarter of an hour on two
cores, `--full` about three hours. With `--only` and the beginnings of titles, those sections alone are measured, and
the rest of the page stays as it is.
"""

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import pneumorph

HERE = Path(__file__).resolve().parent
PLACE = HERE.parent / "docs" / "performance.md"
HEAD = """# Performance

Every section except the last is the output of the named benchmark; `python benchmarks/all.py --{size} RUNS` runs them
all.

Machine: {machine}. Compare figures within a table only: other machines, and this one at other times, are faster or
slower as a whole. An *equivalent* is the time of one assembly and factorisation of the tangent on the same mesh.
"""

FOOT = """
## Where the time goes

A design needs at least about one and a half equivalents: one factorisation near the solution, whose inertia certifies
stability and with which the adjoint is solved, and about twenty back-solves. The remaining time is spent as follows.

- **At the paper's size** a case takes a sixth to an 80th of the paper's time, on one core in place of sixteen.

  | case | share of the paper's time | as good as the paper after | share of the paper's time until then |
  |---|---|---|---|
  | `linear_spring` | a sixth | 18 of 40 designs | a 15th |
  | `bending_spring` | an eighth | 16 of 25 designs | a 33rd |

  Of `linear` and `linear_spring` a quarter of the body is solved, so their sub-problems take more than half of the
  time. `bending` ends at 347°, because it would self-intersect after a longer step.
- **A factorisation at the predicted state**, with predicted volume ratios. For the linear actuator with 80,349
  unknowns, a step of 0.54 mm and one thread, the cost from the prediction to the solution, including its factorisation,
  is 2.3 equivalents. Alternatives are not better:
    - Quasi-Newton steps with the factor of the previous design alone, with a memory of twenty steps, need 2.4 to 2.9
      equivalents. (The eigenvalues of M⁻¹K are between 0.1 and 11, and conjugate gradients need 35 products for a
      residual of 1e-4.)
    - A prediction of second order is worse: its second-order term is as large as the first, and the residual grows from
      6.9 to 23 times the applied force.
    - A factor in single precision takes 0.48 s instead of 0.80 s, and a back-solve 31 ms instead of 43 ms. It needs a
      separate symbolic analysis of 0.7 s for every mesh, and there is a new mesh for about every five designs.
    - PARDISO's own Krylov mode takes as long as a factorisation. PARDISO for positive definite matrices is a tenth
      faster, but does not give the inertia. Its two-level scheduling makes no difference.
- **Long steps of thin bodies.** Near ballooning, and if a body bends by 30° per design, a step is divided into two to
  four parts of three to eight factorisations each. As a whole it would be rejected, and half of it would gain half.
  Alternatives:
    - Volume ratios in every solution: with rough displacements, twenty factorisations find no equilibrium.
    - Volume ratios down to a tenth of the applied force instead of three tenths: no fewer factorisations.
    - An immediate factorisation instead of steps with that of the previous design: the same cost.
    - Forty steps of conjugate gradients for the fit instead of a hundred: one to three more factorisations.
- **Steps that end in ballooning.** A few of the last designs of a run take as many factorisations as all previous
  designs, because no step longer than some hundredths of a millimetre has an equilibrium. The lowest frequency of the
  body does not predict this. For `twisting_spring` it gives the length of such a step within a factor of five, one
  design earlier. For `bending_spring` it does not change, because its softest motion is a different one.
- **Mixed elements** take three to four factorisations per design, plain elements one or two. The last factorisation is
  always that of the solution, for stability and adjoint, since conjugate gradients do not apply to a saddle point.
- **Corrections near the factorised state** take two products for the stability and about four for the adjoint. With two
  threads this takes nearly as long as a factorisation at the solution, because memory limits a back-solve.
- **The sub-problem** takes half of the time with as many variables as the paper: 5 programs with 6 updates of the
  multipliers and up to 20 iterations each. Alternatives:
    - Two updates lose a fifth of the gain late in a run.
    - Four programs lose 3 to 4 % of the gain.
    - If each update starts from zero, 20 iterations lose a tenth.
    - Ten updates of ten iterations promise more and end worse.
    - Starting from the previous step promises some per cent more, but makes rougher shapes, which gain less.
    - All rows can become active, so none can be omitted.
    - A product for smoothing and limits together, compiled by Numba, is slower than SciPy's.
    - A second thread and matrices in single precision gain nothing at these sizes.
- **Repair of steps**, with certificates, takes about one and a half times as long as the programs. With 13,582
  variables it needs four to six motions under ten to fourteen thousand linearised limits. Hundreds to thousands of them
  are violated at first, so methods for few active limits are no faster. Fewer motions cause more rejected steps.
  Motions with half or twice as many iterations take longer in total. Motions that start from the step itself, with the
  multipliers of the previous motion, do not converge, because the curvature of the limits is not corrected.
- **New meshes**: Netgen and the symbolic analysis take two thirds of the time for each.
- **Targets of several motions**: the gradients of the arms' sections need a right-hand side for every section.

On first use, Numba's compilation of the certificate's kernels takes more than half of the processor time. It takes as
long without their entry points for Python, and with less optimisation by LLVM.
"""


PICTURE = "images/growth.png"

MESHES = ("8000", "20000", "50000", "100000")
"""Elements of the meshes on which other programs are measured; the last has nearly half a million unknowns."""


@dataclass(frozen=True)
class Section:
    """A benchmark: what it answers, its command for a quick and for a full measurement, and whether it prints Markdown.

    A command that is None is left out. A picture is drawn by the full measurement alone.
    """

    title: str
    about: str
    quick: list[str] | None
    full: list[str] | None
    markdown: bool = False
    picture: str = ""


def sections(runs: Path, out: Path) -> list[Section]:
    """All benchmarks, for a folder of finished runs and one for what they write."""
    found = [str(path.parent) for path in sorted(runs.glob("*/result.json"))]
    finished = [path.parent.name for path in sorted((runs / "paper_size").glob("*/result.json"))]
    linear, example = str(runs / "linear"), str(HERE.parent / "examples" / "linear.toml")
    return [
        Section(
            "A design of every example",
            "Medians over the designs of finished runs: factorisations, equivalents, and seconds for each part.",
            ["iteration.py", *found],
            ["iteration.py", *found],
        ),
        Section(
            "By version",
            "Of a design of every example: median factorisations / median equivalents (shares of geometry, "
            "equilibrium, gradient and sub-problem in all time); also in ratios.json.",
            ["ratios.py", *found],
            ["ratios.py", *found],
            markdown=True,
        ),
        Section(
            "Beside the paper",
            "Designs and time, with the values of the paper's Table II in brackets, for sixteen cores. "
            "The starts of both twisting bodies turn slightly the other way.",
            ["table.py", *found],
            ["table.py", *found],
            markdown=True,
        ),
        Section(
            "At the paper's size",
            'The paper\'s ten cases with as many coordinates of control points as its Table II has "control points".',
            ["paper_size.py", str(runs / "paper_size"), *finished] if finished else None,
            ["paper_size.py", str(runs / "paper_size")],
            markdown=True,
        ),
        Section(
            "The sub-problem",
            "One step within the limits, in the middle of a run, for several densities of control points.",
            ["subproblem.py", "0.6", "0.85"],
            ["subproblem.py"],
        ),
        Section(
            "The limits",
            "Their values and gradients, the search for close pairs, and the certificate.",
            ["limits.py"],
            ["limits.py"],
        ),
        Section(
            "Half and a quarter of a body",
            "The linear actuator: a quarter between two mirror planes, half of it, and the whole body.",
            ["symmetry.py", example, "3.0", "xz,yz"],
            ["symmetry.py", example, "2.0", "xz,yz"],
        ),
        Section(
            "Growth with the mesh",
            "The best design of `linear`; the solution on each mesh starts from the state on the previous mesh.",
            ["growth.py", linear, "3.0", "2.0", "1.4"],
            ["growth.py", linear, "2.0", "1.4", "1.0"],
            markdown=True,
        ),
        Section(
            "Graded meshes",
            "Starts on equal elements, and on those that are divided as `mesh.error` asks for it.",
            ["grading.py", "linear:5"],
            ["grading.py"],
            markdown=True,
        ),
        Section(
            "Beside other finite-element programs",
            "One equilibrium with the same mesh and load, from rest, for all installed programs.",
            ["solvers.py", "8000"],
            ["solvers.py", "--plot", str(PLACE.parent / PICTURE), *MESHES],
            picture=PICTURE,
        ),
        Section(
            "First use",
            "Commands without compiled kernels, and repeated with them.",
            ["first_use.py"],
            ["first_use.py"],
            markdown=True,
        ),
        Section(
            "Studies",
            "Eight members on two cores.",
            None,
            ["studies.py", str(out / "study")],
            markdown=True,
        ),
        Section(
            "Making",
            "Split moulds of the starting bodies of the examples.",
            ["making.py", str(out / "making"), "linear"],
            ["making.py", str(out / "making")],
            markdown=True,
        ),
        Section(
            "The boundary formula",
            "Error of the paper's gradient against the exact gradient, on finer meshes.",
            None,
            ["boundary.py"],
        ),
        Section(
            "Random problems",
            "Random problems, ten designs each.",
            None,
            ["yield.py", str(int(time.time())), "10", "--out", str(out / "yield"), "--threads", "1"],
        ),
    ]


def machine() -> str:
    """The machine in words."""
    names = {
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    }
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1024**3
    load = os.getloadavg()[0]
    programs = f"Python {platform.python_version()}, JAX {version('jax')}, NumPy {version('numpy')}"
    name = ", ".join(sorted(names)) or platform.machine()
    return f"{os.cpu_count()} cores ({name}), {memory:.0f} GiB, {programs}; load at the start {load:.1f}"


def measured(section: Section, command: list[str]) -> str:
    """The page's part for a benchmark."""
    began = time.perf_counter()
    script, *arguments = command
    done = subprocess.run([sys.executable, str(HERE / script), *arguments], capture_output=True, text=True)
    said = done.stdout.rstrip()
    if done.returncode:
        said += f"\nended with status {done.returncode}: {(done.stderr.strip().splitlines() or ['nothing said'])[-1]}"
    body = said if section.markdown and not done.returncode else f"```text\n{said}\n```"
    if section.picture and command is section.full:
        body += f"\n\n![{section.title}]({section.picture})"
    minutes = (time.perf_counter() - began) / 60
    print(f"{section.title}: {minutes:.1f} min", flush=True)
    told = f"`benchmarks/{script}`, {minutes:.1f} min, version {pneumorph.__version__}"
    return f"\n## {section.title}\n\n{section.about} {told}.\n\n{body}\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    size = parser.add_mutually_exclusive_group(required=True)
    size.add_argument("--quick", dest="size", action="store_const", const="quick")
    size.add_argument("--full", dest="size", action="store_const", const="full")
    parser.add_argument("runs", type=Path)
    parser.add_argument("--out", type=Path, default=PLACE, help="the page")
    parser.add_argument("--only", nargs="+", default=[""], metavar="TITLE", help="of the sections to measure")
    asked = parser.parse_args()
    page = HEAD.format(size=asked.size, machine=machine())
    with tempfile.TemporaryDirectory() as folder:
        for section in sections(asked.runs, Path(folder)):
            command = section.quick if asked.size == "quick" else section.full
            if command is None or not section.title.startswith(tuple(asked.only)):
                continue
            part = measured(section, command).replace(f"{asked.runs}{os.sep}", "")
            if asked.only != [""]:
                asked.out.write_text(replaced(asked.out.read_text(), section.title, part))
                continue
            page += part
            asked.out.write_text(page + FOOT)


def replaced(page: str, title: str, part: str) -> str:
    """A page with another text for one of its sections; a new one comes before the last."""
    begin = page.find(f"\n## {title}\n")
    begin = page.rindex("\n## ") if begin < 0 else begin
    end = page.find("\n## ", begin + 1) if page.startswith(f"\n## {title}\n", begin) else begin
    return page[:begin] + part + page[end:]


if __name__ == "__main__":
    main()
