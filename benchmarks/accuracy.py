"""How good the estimated error of the mesh is: the estimate over the true error, on many states.

    python benchmarks/accuracy.py OUT.jsonl [--ends 11] [--starts 0] [--random 20] [--bodies 10] [--small 0]
                                  [--runs DIR] [--elements 40] [--most 800] [--seed 46] [--limit 300]

States are those of eleven examples (`vacuum` has no value), of their design after `DESIGNS` steps on a coarse mesh, or
else of their start; of problems drawn at random (`random_problems.py`), with bodies short enough for coarse meshes; of
bodies from CAD files drawn at random (`random_bodies.py`), every third of both against a plane that it touches; of
small parts of tubes, bare, with fibres, with a sheet, and pressed against a plane; and of finished runs in DIR. Each
follows from the seed and its number alone. Elements of the random ones are plain, of a compressible rubber, and mixed
in turn. Meshes are so coarse that they have about so many elements; where the coarsest mesh has more than `--most`, or
no true error is found, the next one is drawn in its place. The true error is by two refinements: the state is solved on
both, and what further ones add is extrapolated by the ratio of the two changes. It is that of the tip's motion along
its own direction. Lines are written state by state; states already in OUT are not repeated, and tables follow at the
end.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

import pneumorph as pm
from pneumorph.analysis.accuracy import BEYOND, refined_model
from pneumorph.analysis.analyse import DESIGN_TOLERANCE
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import NoEquilibrium, Tangent, part_of, settled, solve
from pneumorph.objective import measure_features
from pneumorph.problem import Problem, load, loads
from pneumorph.problem.contact import ACTIVATION
from pneumorph.problem.designed import starting_at

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = (
    *("linear", "arm_planar", "syringe", "bending", "dome", "curved_finger", "fibres", "vacuum", "twisting"),
    *("arm_series", "small"),
)
"""Those whose second refinement two cores solve: with contact, fibres, arms, filled chambers, a body from a file."""

DESIGNS = 2
"""Steps from the start of an example to the design whose state is estimated."""

DESIGNED = 2.5
"""How much larger elements of tubes are while they are designed."""

COMPACT = 3.5
"""Longest random problems, in radii."""

SMALL_ERROR = 0.005
"""Errors below this part of the motion are told apart: contributions of both signs nearly cancel in them."""

COARSER = 1.6
"""Most that elements of bodies from files are larger than asked for: faces are lost where they are much larger."""

Case = Callable[[], tuple[Problem, Body, Any]]


def cases(asked: argparse.Namespace, measured: Callable[[str], int]) -> Iterator[tuple[str, Case]]:
    """The states, those of each kind in turn, so that a part of them is a sample of all.

    Parameters
    ----------
    asked : how many of each kind.
    measured : how many whose names begin so have a value by now. Drawing goes on until as many as are asked for have.
    """
    runs = sorted(path.parent for path in asked.runs.glob("*/result.json")) if asked.runs else []
    files = [ROOT / "examples" / f"{name}.toml" for name in EXAMPLES]
    drawn = {"random": (asked.random, _random), "body": (asked.bodies, _body), "small": (asked.small, _small)}
    kinds: list[Iterator[tuple[str, Case]]] = [
        _ended(files[: asked.ends], measured),
        ((f"start {path.stem}", _start(path)) for path in files[: asked.starts]),
        ((f"run {path.name}", _run(path)) for path in runs),
    ]
    kinds += [_drawn(kind, measured, *of, asked.seed) for kind, of in drawn.items()]
    while kinds:
        for kind in list(kinds):
            case = next(kind, None)
            if case is None:
                kinds.remove(kind)
            else:
                yield case


def _ended(files: list[Path], measured: Callable[[str], int]) -> Iterator[tuple[str, Case]]:
    """Designs of examples; the start of one whose design has no value."""
    for path in files:
        yield f"end {path.stem}", _end(path)
        if not measured(f"end {path.stem}"):
            yield f"start {path.stem}", _start(path)


def _drawn(
    kind: str, measured: Callable[[str], int], asked: int, draw: Callable[[int, int], Case], seed: int
) -> Iterator[tuple[str, Case]]:
    """Those of a kind that is drawn at random, until as many as are asked for have a value."""
    for number in count():
        if measured(f"{kind} ") >= asked:
            return
        yield f"{kind} {number}", draw(seed, number)


SMALL = """
[material]
name = "Hei-Cast 8400"
[body]
length = "{length} mm"
radius = "10 mm"
symmetry = {part}
[[body.chamber]]
name = "A"
radius = "{radius} mm"
center = ["0 mm", "0 mm"]
span = ["3 mm", "{end} mm"]
[[task]]
name = "move"
pressure = {{ A = "{pressure} kPa" }}
objective = {{ motion = "extension" }}
[mesh]
size = "{size} mm"
element = "{element}"
[end_effector]
spring = {{ axial = "{spring} N/mm" }}
{more}
"""
PARTS = ('{ mirror = ["xz", "yz"] }', "{ rotation = 3 }", "{ rotation = 4 }")
MORE = {
    "bare": "",
    "fibres": '[[fibres]]\nname = "wrap"\nsurfaces = ["exterior"]\nstiffness = "5 N/mm"\nwinding = "70 deg"\n',
    "sheet": '[[membrane]]\nname = "skin"\nsurfaces = ["exterior"]\nstiffness = "2 N/mm"\n',
    "pressed": '[[obstacle]]\nname = "wall"\nkind = "plane"\npoint = ["0 mm", "0 mm", "{wall} mm"]\n'
    "normal = [0, 0, -1]\n[contact]\nself = false\n",
}


def _small(seed: int, number: int) -> Case:
    rng = np.random.default_rng([seed, number])
    radius, length = rng.uniform(3.0, 7.0), rng.uniform(20.0, 40.0)
    pressure = rng.uniform(20.0, 120.0) * (10.0 - radius) / 4.0
    values = {
        "radius": f"{radius:.2f}",
        "length": f"{length:.1f}",
        "end": f"{length - 3.0:.1f}",
        "pressure": f"{pressure:.1f}",
        "size": f"{rng.uniform(6.5, 9.0):.2f}",
        "part": rng.choice(PARTS),
        "spring": f"{rng.choice([0.0, rng.uniform(0.2, 3.0)]):.2f}",
        "element": ("quadratic", "mixed")[number % 2],
        "more": MORE[("bare", "fibres", "bare", "sheet", "pressed")[number // 2 % 5]],
    }
    values["more"] = values["more"].replace("{wall}", f"{length + 1e-3 * pressure:.3f}")

    def case():
        problem = loads(SMALL.format(**values))
        return problem, body_of(problem), None

    return case


def _start(path: Path) -> Case:
    def case():
        problem = load(path, trust=True)
        return problem, body_of(problem), None

    return case


def _end(path: Path) -> Case:
    def case():
        problem = load(path, trust=True)
        size = problem.mesh.size
        size = COARSER * size if problem.solid is not None else min(DESIGNED * size, 0.9 * problem.body.radius)
        coarse = problem.with_changes({"mesh.size": f"{size:.3g} mm", "optimizer.iterations": DESIGNS})
        *_, design = pm.designs(coarse)
        free = any(pressure.free for task in problem.task for pressure in task.pressure.values())
        found = starting_at(problem, design.pressures) if free else problem
        return found, design.body, (design.stored, design.results)

    return case


def _run(path: Path) -> Case:
    def case():
        design = pm.open_run(path, trust=True).best
        return design.problem, design.body, (design.stored, design.results)

    return case


def _random(seed: int, number: int) -> Case:
    def case():
        import random_problems

        problem = _with_elements(loads(random_problems.draw(seed, number, COMPACT).text), number)
        return problem, body_of(problem), None

    return case


def _body(seed: int, number: int) -> Case:
    def case():
        import random_bodies

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "problem.toml"
            random_bodies.draw(seed, number).write(path)
            problem = load(path)
        problem = _with_elements(problem, number)
        return problem, body_of(problem), None

    return case


def _with_elements(problem: Problem, number: int) -> Problem:
    """With plain and mixed elements in turn; plain ones are not for nearly incompressible rubber."""
    if number % 2:
        return problem.with_changes({"mesh.element": "mixed"})
    return problem.with_changes({"mesh.element": "quadratic", "material": {"name": "Hei-Cast 8400"}})


def solved_coarsely(name: str, case: Case, elements: int, most: int) -> Solved:
    """The states on a coarse mesh of about so many elements; ProblemError if it has more than `most`."""
    problem, body, known = case()
    if name.startswith("small"):
        return analyse_near(problem, body, part_of(problem))
    usual = problem.mesh.size
    first = 1.5 * usual
    there = _count(problem, body, first)
    # No larger than the radius of tubes, nor than sections.
    largest = COARSER * usual if problem.solid is not None else max(usual, 0.9 * problem.body.radius)
    slices = max(task.objective.section_count[1] for task in problem.task)
    largest = min(largest, 0.99 * problem.body.length / slices) if slices and problem.solid is None else largest
    size = min(largest, max(usual, first * (there / elements) ** (1 / 3)))
    changes = {"mesh.size": f"{size:.3g} mm"}
    if problem.contact is not None:
        changes["contact.distance"] = f"{ACTIVATION * usual:.3g} mm"
    problem = problem.with_changes(changes)
    if (there := _count(problem, body, problem.mesh.size)) > most:
        raise pm.ProblemError(f"{there} elements are too many")
    found = analyse_near(problem, body, part_of(problem), *(known or (None, None)))
    kind, number = name.split(maxsplit=1)
    if kind not in ("random", "body") or int(number) % 3 or problem.obstacle:
        return found
    problem = against_a_plane(problem, found, ACTIVATION * usual)
    return analyse_near(problem, body, part_of(problem))


def _count(problem: Problem, body: Body, size: float) -> int:
    """The elements of a size, mm, of the part of a body that is analysed."""
    return len(mesh_of(problem, body, part_of(problem), size).mesh.tets)


def against_a_plane(problem: Problem, found: Solved, distance: float) -> Problem:
    """The problem with a plane in the way of the tip, where it is at a third of its motion."""
    equilibrium = next(iter(found.analysis.equilibria.values()))
    across = int(np.abs(equilibrium.plate[:3]).argmax())
    way = float(equilibrium.plate[across])
    sign = 1.0 if way > 0 else -1.0
    X = found.analysis.X
    point, normal = np.zeros(3), np.zeros(3)
    point[across] = sign * (sign * X[:, across]).max() + way / 3
    normal[across] = -sign
    table = {"name": "wall", "kind": "plane", "point": [f"{x:.6g} mm" for x in point], "normal": normal.tolist()}
    return problem.with_changes({"obstacle": [table], "contact.distance": f"{distance:.3g} mm"})


def measured(name: str, found: Solved) -> Iterator[dict[str, Any]]:
    """The estimate and the true error of every task."""
    problem, disc, analysis = found.problem, found.disc, found.analysis
    first = refined_model(problem, disc.morph.mesh.at(analysis.X))
    for task, at in list(analysis.configurations.items())[:1]:
        state = analysis.equilibria[task].state
        near = None if first is None else first.near(at, disc.tangents[task], state)
        line = {
            "state": name,
            "task": task,
            "elements": disc.model.elements,
            "mixed": disc.model.mixed,
            "contact": disc.model.contact is not None,
            "layers": bool(disc.model.reinforcements),
        }
        if first is None or near is None:
            yield line | {"failed": "no estimate"}
            continue
        begin, estimated, searched = near
        tangent = Tangent(first.model)
        answer = solve(begin, tangent, estimated, DESIGN_TOLERANCE, most=20)
        if isinstance(answer, NoEquilibrium):
            yield line | {"failed": answer.reason}
            continue
        second = refined_model(problem, first.fine.mesh)
        begin = settled(begin, answer)
        near = None if second is None else second.near(begin, tangent, answer.state)
        if second is None or near is None:
            yield line | {"failed": "no state on the second refinement"}
            continue
        last = solve(near[0], Tangent(second.model), near[1], DESIGN_TOLERANCE, most=20)
        if isinstance(last, NoEquilibrium):
            yield line | {"failed": last.reason}
            continue
        motions = []
        for each, own in ((at, state), (begin, estimated), (begin, answer.state), (near[0], last.state)):
            moved = measure_features(each.model, each.X, own, shift=each.loads.shift)
            motions.append(np.concatenate([moved.translation, moved.rotation]))
        # Along the motion itself, with rotations at a lever of a tenth of the body's length.
        lever = np.repeat([1.0, 0.1 * problem_length(found)], 3)
        along = lever * motions[0] / np.linalg.norm(lever * motions[0])
        zero, guess, one, then = (float(along @ (lever * motion)) for motion in motions)
        ratio = (then - one) / (one - zero)
        beyond = ratio / (1.0 - ratio) if 0.0 < ratio < 0.6 else BEYOND - 1.0
        true = then - zero + (then - one) * beyond
        value = BEYOND * (guess - zero)
        yield line | {
            "searched": searched,
            "motion": zero,
            "one": one - zero,
            "estimated one": guess - zero,
            "two": then - zero,
            "ratio": ratio,
            "true": true,
            "estimate": value,
            "effectivity": value / true,
        }


def problem_length(found: Solved) -> float:
    return float(np.ptp(found.analysis.X[:, 2]))


def table(lines: list[dict[str, Any]]) -> str:
    """The effectivities in Markdown, and the share that is within 0.5 to 2."""
    rows = ["| state | elements | motion | error | estimate | effectivity |", "|---|---|---|---|---|---|"]
    good = [line for line in lines if "effectivity" in line]
    for line in good:
        kinds = ", ".join(kind for kind in ("mixed", "contact", "layers") if line[kind])
        rows.append(
            f"| {line['state']}{f' ({kinds})' if kinds else ''} | {line['elements']} | {line['motion']:.4g} | "
            f"{line['true']:+.3g} | {line['estimate']:+.3g} | {line['effectivity']:.2f} |"
        )
    large = [line for line in good if abs(line["true"]) >= SMALL_ERROR * abs(line["motion"])]
    within, of_large = (sum(0.5 <= line["effectivity"] <= 2.0 for line in some) for some in (good, large))
    rows.append(
        f"\n{within} of {len(good)} within 0.5 to 2, {of_large} of {len(large)} with errors of "
        f"{100 * SMALL_ERROR:g} % or more; {len(lines) - len(good)} without a value:"
    )
    rows += [f"- {line['state']}: {line['failed']}" for line in lines if "failed" in line]
    return "\n".join(rows)


def by_class(lines: list[dict[str, Any]]) -> str:
    """The same by what states are of, in Markdown: how many are within 0.5 to 2, and the median and ends of all."""
    rows = ["| states | number | within 0.5 to 2 | median | all |", "|---|---|---|---|---|"]
    classes: dict[str, list[float]] = {}
    for line in lines:
        if "effectivity" in line:
            contact, layers = ", pressed" * line["contact"], ", fibres or a sheet" * line["layers"]
            kind = f"{line['state'].split()[0]}, {'mixed' if line['mixed'] else 'plain'}{contact}{layers}"
            classes.setdefault(kind, []).append(line["effectivity"])
            classes.setdefault("together", []).append(line["effectivity"])
    for kind in sorted(classes, key=lambda kind: (kind == "together", kind)):
        found = classes[kind]
        within = sum(0.5 <= value <= 2.0 for value in found)
        rows.append(
            f"| {kind} | {len(found)} | {within} | {np.median(found):.2f} | {min(found):.2f} to {max(found):.2f} |"
        )
    return "\n".join(rows)


class Late(Exception):
    """A state took too long."""


def _late(*_: Any) -> None:
    raise Late


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--elements", type=int, default=40)
    parser.add_argument("--seed", type=int, default=46)
    parser.add_argument("--most", type=int, default=800, help="elements: the second refinement has 64 times as many")
    parser.add_argument("--ends", type=int, default=11, help="of the examples, after some designs")
    parser.add_argument("--starts", type=int, default=0, help="of the examples")
    parser.add_argument("--random", type=int, default=20)
    parser.add_argument("--bodies", type=int, default=10)
    parser.add_argument("--small", type=int, default=0)
    parser.add_argument("--runs", type=Path)
    parser.add_argument("--limit", type=float, default=300.0, help="processor seconds for a state")
    asked = parser.parse_args()
    sys.path.insert(0, str(ROOT / "benchmarks"))
    done = [json.loads(line) for line in asked.out.read_text().splitlines()] if asked.out.exists() else []
    known = {line["state"] for line in done}
    signal.signal(signal.SIGPROF, _late)

    def with_value(begin: str) -> int:
        return len({line["state"] for line in done if line["state"].startswith(begin) and "effectivity" in line})

    for name, case in cases(asked, with_value):
        if name in known:
            continue
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, asked.limit)
        try:
            lines = list(measured(name, solved_coarsely(name, case, asked.elements, asked.most)))
        except Late:
            lines = [{"state": name, "failed": f"more than {asked.limit:g} s"}]
        except (pm.ProblemError, pm.ComputationError) as error:
            lines = [{"state": name, "failed": str(error)[:200]}]
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        with asked.out.open("a") as file:
            for line in lines:
                words = json.dumps({**line, "seconds": round(time.process_time() - began, 1)})
                file.write(f"{words}\n")
                print(words, flush=True)
        done += lines
    print(table(done))
    print(f"\n{by_class(done)}")


if __name__ == "__main__":
    main()
