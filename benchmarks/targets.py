"""How often `propose` finds a body for a target that somebody states.

    python benchmarks/targets.py runs/targets --count 30 --minutes 30

A target is drawn with a space, a rubber, a pressure and a load. A large search of another seed maximises its motion,
and the target asks for a share of that, between half and all; the search that is tried knows nothing of the large one.
A target is met where every motion is within 2° or 2 mm. Everything is kept in the folder, and the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.optimize.settings import LoopSettings
from pneumorph.problem.material import elastomer
from pneumorph.proposals import Plan, Proposal, Target, propose
from pneumorph.study import Member
from pneumorph.study.members import MemberEnd, run_member

CLASSES: dict[str, tuple[str, ...]] = {
    "bend": ("bending_y",),
    "twist": ("twist",),
    "extend": ("extension",),
    "lift": ("shift_x",),
    "two ways": ("bending_y", "bending_x"),
}
"""The motions of each class, a task each."""

RUBBERS = ("Hei-Cast 8400", "Dragon Skin 30", "Smooth-Sil 950")

WITHIN = 2.0
"""Degrees or millimetres."""


def drawn(
    seed: int, index: int, lengths: tuple[float, float], classes: Sequence[str]
) -> tuple[str, dict[str, Any], float]:
    """The class of a target, its tables without tasks, and the share of the largest motion that it asks for."""
    rng = np.random.default_rng([seed, index])
    name = classes[index % len(classes)]
    rubber = RUBBERS[int(rng.integers(len(RUBBERS)))]
    length = rng.uniform(*lengths)
    radius = length * rng.uniform(0.18, 0.35)
    pressure = elastomer(rubber).initial_shear_modulus * rng.uniform(0.15, 0.3)
    force = pressure * math.pi * radius**2 * rng.uniform(0.02, 0.08)
    share = rng.uniform(0.5, 1.0)
    loads = {
        "extend": {"force": ["0 N", "0 N", f"{-force:.3g} N"]},
        "lift": {"force": [f"{-force * radius / length:.3g} N", "0 N", "0 N"]},
        "twist": {"spring": {"torsion": f"{force * radius:.3g} N*mm/rad"}},
        "bend": {"spring": {"bending_y": f"{force * radius:.3g} N*mm/rad"}},
    }
    content = {
        "material": {"name": rubber},
        "space": {"length": f"{length:.3g} mm", "radius": f"{radius:.3g} mm"},
        "pressure": {"max": f"{1e3 * pressure:.3g} kPa"},
        "limits": {"wall": f"{max(1.2, 0.15 * radius):.2g} mm"},
        "end_effector": loads.get(name, {}),
    }
    return name, content, float(share)


def asked_for(name: str, stated: Sequence[float] | None) -> dict[str, Any]:
    """The tasks of a class: with the motions that are stated, or as far as they go."""
    if stated is None:
        return {"task": [{"name": each, "objective": {"motion": each}} for each in CLASSES[name]]}
    units = ["mm" if each in ("extension", "shift_x") else "deg" for each in CLASSES[name]]
    goals = zip(CLASSES[name], stated, units, strict=True)
    return {
        "task": [
            {"name": each, "objective": {"kind": "motion", each: f"{value} {unit}"}} for each, value, unit in goals
        ]
    }


def searched(content: Mapping[str, Any], out: Path, plan: Plan) -> Proposal | None:
    """The best of a search, in this process."""

    def run(members: Mapping[str, Member], settings: LoopSettings) -> Iterator[MemberEnd]:
        for name, member in members.items():
            yield run_member(name, member.problem, str(out / name), lambda *_: None, False, member.begin, settings)

    out.mkdir(parents=True, exist_ok=True)
    [best, *_] = propose(Target.model_validate(content), out, plan, run, 1, print)
    return best if best.entry is not None else None


def motions(found: Proposal | None) -> list[float] | None:
    """What is reached in every task, in degrees or mm."""
    if found is None or found.entry is None:
        return None
    return [task.objective.achieved(found.entry.tasks[task.name]).value for task in found.candidate.posed.task]


def tried(index: int, asked: argparse.Namespace, plan: Plan, large: Plan) -> dict[str, Any]:
    """State a target and search bodies for it."""
    name, content, share = drawn(asked.seed, index, tuple(asked.lengths), asked.classes)
    folder, start = asked.out / f"{index:03d}", time.monotonic()
    reached = motions(searched(content | asked_for(name, None), folder / "large", large))
    found: dict[str, Any] = {"class": name, "target": content, "share": share, "largest": reached}
    if reached is None or min(reached) <= 0.0:
        return found | {"stated": None}
    stated = [round(share * min(reached), 3)] * len(CLASSES[name])
    begun = time.monotonic()
    best = motions(searched(content | asked_for(name, stated), folder / "stated", plan))
    gaps = None if best is None else [abs(one - other) for one, other in zip(best, stated, strict=True)]
    return found | {
        "stated": stated,
        "achieved": best,
        "met": gaps is not None and max(gaps) <= WITHIN,
        "minutes": (time.monotonic() - begun) / 60.0,
        "minutes of the large search": (begun - start) / 60.0,
    }


def table(rows: list[dict[str, Any]]) -> None:
    """Print the targets that are met, by class."""
    print("| class | targets | met | median gap | median minutes |")
    print("|---|---|---|---|---|")
    for name in CLASSES:
        own = [row for row in rows if row["class"] == name and row["stated"] is not None]
        if not own:
            continue
        gaps = [
            max(abs(one - other) for one, other in zip(row["achieved"], row["stated"], strict=True))
            for row in own
            if row["achieved"] is not None
        ]
        gap = f"{statistics.median(gaps):.2g} {'mm' if name in ('extend', 'lift') else '°'}" if gaps else "none"
        minutes = statistics.median(row["minutes"] for row in own)
        print(f"| {name} | {len(own)} | {sum(row['met'] for row in own)} | {gap} | {minutes:.1f} |")
    print("\n| target | reached by the large search | asked for | reached | met | minutes, of both |")
    print("|---|---|---|---|---|---|")
    for row in rows:
        if row["stated"] is not None:
            unit = "mm" if row["class"] in ("extend", "lift") else "°"
            largest, stated, reached = (
                "none" if own is None else ", ".join(f"{each:.3g}" for each in own) + f" {unit}"
                for own in (row["largest"], row["stated"], row["achieved"])
            )
            minutes = f"{row['minutes of the large search']:.1f}, {row['minutes']:.1f}"
            met = "yes" if row["met"] else "no"
            print(f"| {row['class']} | {largest} | {stated} | {reached} | {met} | {minutes} |")
    without = sum(row["stated"] is None for row in rows)
    if without:
        print(f"\n{without} of {len(rows)} have no target: the large search found nothing that moves as it should.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=30.0, help="of each search that is tried")
    parser.add_argument("--candidates", type=int, default=24)
    parser.add_argument(
        "--large", type=float, default=3.0, help="candidates and minutes of the large search over those"
    )
    parser.add_argument("--classes", nargs="+", choices=list(CLASSES), default=list(CLASSES), help="in turn")
    parser.add_argument("--stages", type=int, nargs="+", default=[2, 6, 14])
    parser.add_argument("--designs", type=int, default=20)
    parser.add_argument("--lengths", type=float, nargs=2, default=[40.0, 100.0], help="of the space, mm")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    plan = Plan(asked.candidates, 1, asked.minutes, tuple(asked.stages), asked.designs)
    most = round(asked.large * asked.candidates), asked.large * asked.minutes
    large = Plan(most[0], 2, most[1], tuple(asked.stages), asked.designs)
    rows = []
    for index in range(asked.count):
        path = asked.out / f"{index:03d}.json"
        if not path.exists():
            path.write_text(json.dumps(tried(index, asked, plan, large), indent=1))
        rows.append(json.loads(path.read_text()))
        print(json.dumps(rows[-1]), flush=True)
    table(rows)


if __name__ == "__main__":
    main()
