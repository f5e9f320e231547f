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

HERE = Path(__file__).resolve().parent
PLACE = HERE.parent / "docs" / "performance.md"
HEAD = """# Performance

Every section but the last is the output of the benchmark that it names; `python benchmarks/all.py --{size} RUNS` runs
them all.

Machine: {machine}. Compare figures within a table: other machines, and this one at other times, are faster or slower as
a whole. An *equivalent* is the time of one assembly and factorisation of the tangent on the same mesh.
"""

FOOT = """
## What limits next

A design needs at least about one and a half equivalents: one factorisation near the answer, whose inertia certifies
that the state is stable and with which the adjoint is solved, and some twenty back-solves. Beyond that it spends:

- **At the paper's size** every case takes a tenth to a hundredth of the paper's time. `linear_spring` takes a tenth for
  its 40 designs, which make it nearly twice as good as the paper's; it is as good after 18, in a twenty-fifth of the
  paper's time. Half of its time is the sub-problem's, and three factorisations a design are of the whole body, to see
  that it does not buckle to a side. `bending_spring` takes a thirteenth, more than half of which are its last two
  designs, near ballooning; it is as good as the paper after 16 of 25, in a 44th of the paper's time. `bending` ends at
  348°, where a longer step would make it go through itself.
- **A factorisation at the predicted state**, with volume ratios that are predicted too. The linear actuator with
  80,349 unknowns, a step of 0.54 mm, one thread, in equivalents from the prediction to the answer with its
  factorisation: 2.3 so; 2.4 to 2.9 by quasi-Newton steps with the factor of the design before alone, with a memory of
  twenty steps (the eigenvalues of M⁻¹K are from 0.1 to 11, and conjugate gradients take 35 products to a residual of
  1e-4). Prediction of second order makes the start worse, not better: its term is as long as the first, and the
  residual grows from 6.9 to 23 times the applied force. A factor of single precision takes 0.48 s in place of 0.80
  and a back-solve 31 ms in place of 43, but needs a symbolic analysis of its own of 0.7 s for every mesh, of which
  there is one for about five designs. PARDISO's own Krylov mode took as long as a factorisation. PARDISO for positive
  definite matrices is a tenth faster, but does not give the inertia. Its scheduling in two levels makes no
  difference.
- **Long steps of thin bodies**: near ballooning, and where a body bends by 30° a design, a step is gone in two to
  four parts of three to eight factorisations each. Gone as one, it would be taken back, and its half would gain half.
  What was tried: volume ratios in every search (where displacements are rough, twenty factorisations find nothing),
  and down to a tenth of the applied force in place of three tenths (no fewer factorisations); a factorisation at once
  in place of steps with the one of the design before (the same), forty steps of conjugate gradients for the fit in
  place of a hundred (one to three factorisations more).
- **Steps that end in ballooning**: a few of a run's last designs take as many factorisations as all before, because
  no step longer than some hundredths of a millimetre has a state. The lowest frequency of the body does not foresee
  it: of `twisting_spring` it gives the length of such a step within a factor of five, one design before; of
  `bending_spring` it does not change at all, for its softest motion is another one.
- **Mixed elements** take three to four factorisations a design where plain ones take one or two: the last is always
  of the answer itself, for its stability and its adjoint, since conjugate gradients do not apply to a saddle point.
- **Corrections near the factorised state**: two products for the stability and about four for the adjoint. With two
  threads they take nearly as long as a factorisation at the answer would, for a back-solve is limited by memory.
- **The sub-problem**, half of the time where variables are as many as the paper's: 5 programs of 6 updates of the
  prices and up to 20 iterations each. What was tried: two updates lose a fifth of the gain late in a run, four
  programs 3 to 4 % of it; begun at rest with each update, 20 iterations lose a tenth. Ten updates of ten iterations
  promise more and end worse. Beginning with the step before promises some per cent more and makes rougher shapes,
  which gain less. There are no rows out of reach that could be left out. A product compiled by Numba for the
  smoothing and the limits together is slower than SciPy's. A second thread, and matrices of single precision, gain
  nothing at these sizes.
- **Bringing steps within the limits**, with certificates, about one and a half times as long as the programs: with
  13,582 variables four to six motions under ten to fourteen thousand linearised limits, of which hundreds to
  thousands are broken at first, so that methods which need few of them at once do not pay; fewer motions cost more
  rejected steps. Motions of half as many iterations, or twice as many, take longer together. Motions from the step
  itself, each begun with the prices of the one before, do not converge: what the limits' curvature leaves is undone.
- **New meshes**: Netgen and the symbolic analysis are two thirds of each.
- **Targets of several motions**: the gradients of the arms' sections have a right side for every section.

At first use more than half of the processor time is Numba's compilation of the certificate's kernels; without their
entry points for Python it takes as long, and so it does with less optimisation by LLVM.
"""


PICTURE = "images/growth.png"

MESHES = ("8000", "20000", "50000", "100000", "210000")
"""Elements of the meshes on which other programs are measured; the last has nearly a million unknowns."""

EARLIER = "79b18d9"
"""The version before the sub-problem of quadratic programs, sectors, and kernels compiled when they are needed."""


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
            "Medians over the designs of finished runs: factorisations, equivalents, and seconds of each part.",
            ["iteration.py", *found],
            ["iteration.py", *found],
        ),
        Section(
            "Beside the paper",
            "Designs and time, with the values of the paper's Table II in brackets; it used sixteen cores.",
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
            "More variables",
            "The linear actuator, as a whole, with the paper's number of variables and twice as many.",
            None,
            ["denser.py", str(runs / "denser")],
        ),
        Section(
            "An earlier version beside this one",
            "The same designs and commands by both; before → now.",
            None,
            ["before.py", EARLIER, "--designs", "5"],
            markdown=True,
        ),
        Section(
            "The sub-problem",
            "One step within the limits, in the middle of a run, by the density of control points.",
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
            "The linear actuator between two mirror planes, beside one of them, and as a whole.",
            ["symmetry.py", example, "3.0", "xz,yz"],
            ["symmetry.py", example, "2.0", "xz,yz"],
        ),
        Section(
            "Growth with the mesh",
            "The best design of `linear`; each mesh begins from the state on the one before.",
            ["growth.py", linear, "3.0", "2.0", "1.4"],
            ["growth.py", linear, "2.0", "1.4", "1.0", "0.85"],
            markdown=True,
        ),
        Section(
            "Beside other finite-element programs",
            "One equilibrium of the same mesh and load, from rest; programs that are not installed are left out.",
            ["solvers.py", "8000"],
            ["solvers.py", "--plot", str(PLACE.parent / PICTURE), *MESHES],
            picture=PICTURE,
        ),
        Section(
            "First use",
            "Commands with nothing compiled before, and again.",
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
            "The starting bodies of the examples as split moulds.",
            ["making.py", str(out / "making"), "linear"],
            ["making.py", str(out / "making")],
            markdown=True,
        ),
        Section(
            "The boundary formula",
            "The paper's gradient against the exact one, on finer and finer meshes.",
            None,
            ["boundary.py"],
        ),
        Section(
            "Interrupts",
            "Signals at random moments.",
            None,
            ["interrupts.py", "5"],
        ),
        Section(
            "Random problems",
            "Problems that nobody chose, ten designs each.",
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
    return f"\n## {section.title}\n\n{section.about} `benchmarks/{script}`, {minutes:.1f} min.\n\n{body}\n"


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
