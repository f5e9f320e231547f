"""How proposals' bodies are best chosen: random numbers, or what Optuna learns from the bodies before.

    python benchmarks/proposals.py runs/targets

Designs are expensive, so the bodies that searches for random targets (`benchmarks/targets.py`) have designed are used
again. A way to choose names coordinates of a body, and gets the nearest body of the same layout of the same target that
it has not had yet. So all ways see the same bodies, at the same cost, and only the order in which they find them
differs. A start costs one, and the first two designs after it two more; what is compared is the motion of the best body
that got these. The comparison needs optuna and cmaes.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from targets import asked_for

from pneumorph.proposals import Target
from pneumorph.proposals.candidates import Candidate, draw_candidate, suited
from pneumorph.proposals.search import KEPT
from pneumorph.run import open_run

DESIGNS = 2
"""Designs of a body after its start, as many as every candidate of a search makes."""

SEEDS = {"large": 2, "stated": 1}
"""Of the searches of a target."""


class Recorded:
    """Random numbers, which are kept."""

    def __init__(self, seed: int, index: int):
        self._rng, self.used = np.random.default_rng([seed, index]), []

    def __iter__(self) -> Iterator[float]:
        return self

    def __next__(self) -> float:
        self.used.append(float(self._rng.random()))
        return self.used[-1]


class Body(NamedTuple):
    """A body that was designed: its layout and coordinates, and minus its least motion at the start and in the end."""

    layout: str
    numbers: tuple[float, ...]
    start: float
    end: float


def drawn_again(target: Target, seed: int, index: int) -> tuple[Candidate, tuple[float, ...]]:
    """A candidate of a search, and the numbers of the draw that fitted, without those of the draws before it."""
    layouts, _ = suited(target)
    layout, numbers = layouts[index % len(layouts)], Recorded(seed, index)
    found = draw_candidate(target, layout, f"{index + 1:02d}-{layout.name}", numbers)
    for first in reversed(range(len(numbers.used))):
        # A draw that takes more numbers than these has begun before them.
        with suppress(StopIteration):
            alone = draw_candidate(target, layout, found.name, iter(numbers.used[first:]))
            if alone.problem == found.problem:
                return found, tuple(numbers.used[first:])
    return found, tuple(numbers.used)


def motion(folder: Path, designs: int) -> float:
    """Minus the least motion of all tasks after so many designs at most; infinite where limits are violated."""
    run = open_run(folder)
    entries = [each for each in run.history() if each.iteration <= designs]
    if not entries or not entries[-1].held:
        return math.inf
    return -min(task.objective.achieved(entries[-1].tasks[task.name]).value for task in run.problem.task)


def bodies_of(out: Path, index: int) -> list[Body]:
    """The bodies that both searches for a target have designed."""
    row = json.loads((out / f"{index:03d}.json").read_text())
    asked = {"large": None, "stated": row["stated"]}
    found = []
    for kind, seed in SEEDS.items():
        target = Target.model_validate(row["target"] | asked_for(row["class"], asked[kind]))
        folder = out / f"{index:03d}" / kind
        count = sum(not each.name.endswith("-fine") for each in folder.iterdir())
        for number in range(count):
            candidate, numbers = drawn_again(target, seed, number)
            run = folder / candidate.name
            if not (run / "problem.toml").exists():
                continue
            if open_run(run).problem.body != candidate.posed.body:
                raise SystemExit(f"{run}: its body is not the one that is drawn now; search again with this version")
            found.append(Body(candidate.layout, numbers, motion(run, 0), motion(run, DESIGNS)))
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
    return min(each.end for each in in_turn(bodies, np.random.default_rng(seed))[: budget // (1 + DESIGNS)])


def halved(bodies: list[Body], budget: int, seed: int) -> float:
    """All are begun, and the best third of them goes on, as in a search."""
    begun = in_turn(bodies, np.random.default_rng(seed))[: int(budget / (1.0 + KEPT * DESIGNS))]
    best = sorted(begun, key=lambda each: each.start)[: (budget - len(begun)) // DESIGNS]
    return min(each.end for each in best)


def by_optuna(bodies: list[Body], budget: int, seed: int, sampler: str) -> float:
    """Optuna chooses coordinates, and by a Hyperband pruner which bodies go on after their start."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    layouts = sorted({each.layout for each in bodies})
    # CMA-ES has continuous coordinates alone: a study for every layout, in turn; TPE chooses the layout too.
    groups = [layouts] if sampler == "tpe" else [[each] for each in layouts]
    pruner = optuna.pruners.HyperbandPruner(min_resource=1, max_resource=1 + DESIGNS, reduction_factor=3)

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
            # As a body that does not move, so that the next one is of another layout.
            study.tell(trial, 0.0)
            continue
        point = [trial.suggest_float(f"{layout}{k}", 0.0, 1.0) for k in range(len(alike[0].numbers))]
        body = min(alike, key=lambda each: math.dist(each.numbers, point))
        left.remove(body)
        spent += 1
        if not math.isfinite(body.start):
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
            continue
        trial.report(body.start, 1)
        if trial.should_prune() or spent + DESIGNS > budget:
            study.tell(trial, state=optuna.trial.TrialState.PRUNED)
            continue
        spent += DESIGNS
        best = min(best, body.end)
        if math.isfinite(body.end):
            study.tell(trial, body.end)
        else:
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
    return best


WAYS: dict[str, Callable[[list[Body], int, int], float]] = {
    "random": at_random,
    "random with halving": halved,
    "TPE with Hyperband": partial(by_optuna, sampler="tpe"),
    "CMA-ES with Hyperband": partial(by_optuna, sampler="cma"),
}


def compare(out: Path, budgets: Sequence[int], repeats: int) -> None:
    """Print, for every target, the mean share of its bodies that is better than what each way finds."""
    print("| target | bodies | budget | " + " | ".join(WAYS) + " |")
    print("|---|---|---|" + "---|" * len(WAYS))
    every: dict[int, list[np.ndarray]] = {budget: [] for budget in budgets}
    for index in sorted(int(path.stem) for path in out.glob("*.json")):
        name = json.loads((out / f"{index:03d}.json").read_text())["class"]
        bodies = bodies_of(out, index)
        ends = np.array([each.end for each in bodies])
        for budget in budgets:
            found = np.array([[way(bodies, budget, seed) for seed in range(repeats)] for way in WAYS.values()])
            shares = 100.0 * (ends < found[..., None]).mean(axis=2)
            every[budget].append(shares.mean(axis=1))
            errors = shares.std(axis=1, ddof=1) / math.sqrt(repeats)
            cells = [f"{mean:.0f} ± {error:.1f} %" for mean, error in zip(every[budget][-1], errors, strict=True)]
            print(f"| {name} | {len(bodies)} | {budget} | " + " | ".join(cells) + " |", flush=True)
    for budget, rows in every.items():
        means, errors = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1) / math.sqrt(len(rows))
        cells = [f"{mean:.1f} ± {error:.1f} %" for mean, error in zip(means, errors, strict=True)]
        print(f"| all {len(rows)} | | {budget} | " + " | ".join(cells) + " |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="of benchmarks/targets.py")
    parser.add_argument("--budgets", type=int, nargs="+", default=[12, 24])
    parser.add_argument("--repeats", type=int, default=40)
    asked = parser.parse_args()
    compare(asked.out, asked.budgets, asked.repeats)


if __name__ == "__main__":
    main()
