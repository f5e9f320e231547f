"""How proposals' bodies are best chosen: random numbers, or what Optuna learns from the bodies before.

    python benchmarks/proposals.py pool runs/pool --candidates 60     # designs bodies of every target; resumable
    python benchmarks/proposals.py compare runs/pool                  # compares the ways to choose among them

Designs are expensive, so bodies are designed once: the pool. A way to choose then names coordinates of a body, and gets
the nearest body of the same layout in the pool that it has not had yet. So all ways see the same bodies, at the same
cost, and only the order in which they find them differs. A start and a design after it cost one each; what is compared
is the best body that was designed to the end. The comparison needs optuna and cmaes.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pneumorph.proposals import Target
from pneumorph.proposals.candidates import draw_candidate, suited
from pneumorph.proposals.search import KEPT
from pneumorph.run import open_run
from pneumorph.study.members import run_member

DESIGNS = 1
"""Designs of a body after its start."""

SIZE = "4 mm"
"""Of the elements: the pool is to be cheap."""

_SMALL = {
    "material": {"name": "Hei-Cast 8400"},
    "space": {"length": "24 mm", "radius": "9 mm"},
    "limits": {"wall": "1.5 mm"},
}
TARGETS = {
    "bend": _SMALL | {"pressure": {"max": "60 kPa"}, "task": [{"name": "bend", "objective": {"motion": "bending_y"}}]},
    "twist": _SMALL
    | {
        "pressure": {"max": "80 kPa"},
        "end_effector": {"spring": {"torsion": "50 N*mm/rad"}},
        "task": [{"name": "twist", "objective": {"motion": "twist"}}],
    },
    "lift": _SMALL
    | {
        "pressure": {"max": "60 kPa"},
        "end_effector": {"force": ["-0.3 N", "0 N", "0 N"]},
        "task": [{"name": "lift", "objective": {"motion": "shift_x"}}],
    },
}


class Recorded:
    """Random numbers of a body, of which the last ones that were used are kept."""

    def __init__(self, seed: int, index: int):
        self._rng, self.used = np.random.default_rng([seed, index]), []

    def __iter__(self) -> Iterator[float]:
        return self

    def __next__(self) -> float:
        self.used.append(float(self._rng.random()))
        return self.used[-1]


def pool(out: Path, count: int, seed: int, until: float) -> None:
    """Design so many bodies of every target; what is in the files is not designed again."""
    out.mkdir(parents=True, exist_ok=True)
    end = time.monotonic() + 60.0 * until
    for index in range(count):
        for name, content in TARGETS.items():
            path = out / f"{name}-{index:03d}.json"
            if path.exists():
                continue
            if time.monotonic() > end:
                return
            target = Target.model_validate(content)
            layouts, _ = suited(target)
            layout = layouts[index % len(layouts)]
            numbers = Recorded(seed, index)
            drawn = draw_candidate(target, layout, path.stem, numbers)
            found = {"layout": layout.name, "words": drawn.words, "numbers": numbers.used, "values": [], "seconds": 0.0}
            if drawn.problem is not None:
                folder = out / path.stem
                problem = drawn.problem.with_changes({"optimizer.iterations": DESIGNS, "mesh.size": SIZE})
                shutil.rmtree(folder, ignore_errors=True)
                ended = run_member(path.stem, problem, str(folder), lambda _, entry: None, False)
                history = open_run(folder).history() if (folder / "problem.toml").exists() else []
                found |= {
                    "values": [each.objective if each.held else None for each in history],
                    "seconds": sum(each.seconds["total"] for each in history),
                    "end": ended.reason,
                }
                shutil.rmtree(folder, ignore_errors=True)
            path.write_text(json.dumps(found))
            print(path.stem, found["words"], found["values"], f"{found['seconds']:.0f} s", flush=True)


class Body(NamedTuple):
    """A body of the pool: its layout and coordinates, and its objectives at the start and after its designs."""

    layout: str
    numbers: tuple[float, ...]
    start: float
    end: float


def bodies_of(out: Path, target: str) -> list[Body]:
    """The bodies of a target; the objective is infinite where there is no state or limits are violated."""
    found = []
    for path in sorted(out.glob(f"{target}-*.json")):
        data = json.loads(path.read_text())
        values = [math.inf if each is None else each for each in data["values"]]
        start = values[0] if values else math.inf
        found.append(Body(data["layout"], tuple(data["numbers"]), start, min(values, default=math.inf)))
    return found


def in_turn(bodies: list[Body], rng: np.random.Generator) -> list[Body]:
    """All bodies at random, of each layout in turn."""
    order: dict[str, list[Body]] = {}
    for number in rng.permutation(len(bodies)):
        order.setdefault(bodies[number].layout, []).append(bodies[number])
    rounds = zip_longest(*(order[name] for name in sorted(order)))
    return [each for one in rounds for each in one if each is not None]


def at_random(bodies: list[Body], budget: int, seed: int) -> float:
    """Every body is designed to the end."""
    return min(each.end for each in in_turn(bodies, np.random.default_rng(seed))[: budget // 2])


def halved(bodies: list[Body], budget: int, seed: int) -> float:
    """All are begun, and the best third of them goes on, as in a search."""
    begun = in_turn(bodies, np.random.default_rng(seed))[: int(budget / (1.0 + KEPT))]
    best = sorted(begun, key=lambda each: each.start)[: budget - len(begun)]
    return min(each.end for each in best)


def by_optuna(bodies: list[Body], budget: int, seed: int, sampler: str) -> float:
    """Optuna chooses coordinates, and by a Hyperband pruner which bodies go on after their start."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    layouts = sorted({each.layout for each in bodies})
    # CMA-ES has continuous coordinates alone: a study for every layout, in turn; TPE chooses the layout too.
    groups = [layouts] if sampler == "tpe" else [[each] for each in layouts]
    pruner = optuna.pruners.HyperbandPruner(min_resource=1, max_resource=2, reduction_factor=3)

    def study_of(number: int) -> Any:
        if sampler == "tpe":
            own = optuna.samplers.TPESampler(seed=seed, n_startup_trials=5, multivariate=True, group=True)
        else:
            own = optuna.samplers.CmaEsSampler(seed=seed + number, n_startup_trials=1)
        return optuna.create_study(sampler=own, pruner=pruner)

    studies, left = [study_of(number) for number in range(len(groups))], list(bodies)
    best, spent, turn = math.inf, 0, 0
    while left and spent < budget:
        study, group = studies[turn % len(groups)], groups[turn % len(groups)]
        turn += 1
        trial = study.ask()
        layout = trial.suggest_categorical("layout", layouts) if sampler == "tpe" else group[0]
        alike = [each for each in left if each.layout == layout]
        if not alike:
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
            continue
        point = [trial.suggest_float(f"{layout}{k}", 0.0, 1.0) for k in range(len(alike[0].numbers))]
        body = min(alike, key=lambda each: math.dist(each.numbers, point))
        left.remove(body)
        spent += 1
        if not math.isfinite(body.start):
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
            continue
        trial.report(body.start, 1)
        if trial.should_prune() or spent == budget:
            study.tell(trial, state=optuna.trial.TrialState.PRUNED)
            continue
        spent += 1
        best = min(best, body.end)
        study.tell(trial, body.end)
    return best


WAYS: dict[str, Callable[[list[Body], int, int], float]] = {
    "random": at_random,
    "random with halving": halved,
    "TPE with Hyperband": partial(by_optuna, sampler="tpe"),
    "CMA-ES with Hyperband": partial(by_optuna, sampler="cma"),
}


def compare(out: Path, names: Sequence[str], budgets: Sequence[int], repeats: int) -> None:
    """Print, for every target, the mean share of the pool that is better than what each way finds."""
    print("| target | bodies | budget | " + " | ".join(WAYS) + " |")
    print("|---|---|---|" + "---|" * len(WAYS))
    for name in names:
        bodies = bodies_of(out, name)
        ends = np.array([each.end for each in bodies])
        for budget in budgets:
            cells = []
            for way in WAYS.values():
                found = [way(bodies, budget, seed) for seed in range(repeats)]
                ranks = np.array([(ends < each).mean() for each in found])
                cells.append(f"{100 * ranks.mean():.0f} ± {100 * ranks.std(ddof=1) / math.sqrt(repeats):.1f} %")
            print(f"| {name} | {len(bodies)} | {budget} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("pool")
    make.add_argument("out", type=Path)
    make.add_argument("--candidates", type=int, default=60)
    make.add_argument("--seed", type=int, default=0)
    make.add_argument("--minutes", type=float, default=600.0)
    among = commands.add_parser("compare")
    among.add_argument("out", type=Path)
    among.add_argument("--targets", nargs="+", choices=list(TARGETS), default=list(TARGETS))
    among.add_argument("--budgets", type=int, nargs="+", default=[8, 16])
    among.add_argument("--repeats", type=int, default=50)
    asked = parser.parse_args()
    if asked.command == "compare":
        compare(asked.out, asked.targets, asked.budgets, asked.repeats)
    else:
        pool(asked.out, asked.candidates, asked.seed, asked.minutes)


if __name__ == "__main__":
    main()
