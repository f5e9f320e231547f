"""What a further chamber gains that `propose` would try: a candidate's designs with it and without.

    python benchmarks/further.py runs/further --target target.toml --candidates 8 --after 6 --designs 6

Where a sphere promises a twentieth of the objective or more after some designs of a candidate, that begins anew
with it, as in a search, and both are designed as often. A search tries this with its best candidate alone, after its
last comparison.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from pneumorph.errors import ComputationError, ProblemError
from pneumorph.optimize.settings import LoopSettings
from pneumorph.proposals.candidates import Candidate, draw_candidates
from pneumorph.proposals.further import places_in, with_further_chamber
from pneumorph.proposals.stage import member
from pneumorph.proposals.target import load_target
from pneumorph.run import open_run
from pneumorph.study.members import run_member


def designed(candidate: Candidate, designs: int, out: Path) -> list[float]:
    """The objectives of a candidate's start and designs that satisfy the limits."""
    each = member(candidate.name, candidate.posed, max(designs, 1))
    settings = LoopSettings() if designs else LoopSettings(seconds=0.0)
    run_member(each.name, each.problem, str(out / each.name), lambda *_: None, False, None, settings)
    begun = (out / each.name / "problem.toml").exists()
    return [entry.objective for entry in open_run(out / each.name).history() if entry.held] if begun else []


def compared(candidate: Candidate, asked: argparse.Namespace) -> tuple[str, ...]:
    """The row of a candidate: what was promised, and the objectives without and with the chamber, the start's first."""
    folder, began = asked.out / candidate.name, time.process_time()
    without = designed(candidate, asked.after, asked.out)
    try:
        places, value = places_in(folder)
    except (ComputationError, ProblemError) as error:
        return str(error), "", "", ""
    if not without or not places:
        return "no room", "", "", ""
    promised = f"{100 * places[0].gain / abs(value):.1f} % of {abs(value):.4g}"
    added = with_further_chamber(candidate, folder)
    if added is None:
        return promised, "", "", ""
    rows = [designed(each, asked.designs, asked.out) for each in (candidate, added)]
    told = (f"{own[0]:.4g}, {own[-1]:.4g}" if own else "no state" for own in rows)
    return promised, *told, f"{time.process_time() - began:.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--target", type=Path, required=True)
    parser.add_argument("--candidates", type=int, default=8)
    parser.add_argument("--layouts", nargs="+", default=[])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--after", type=int, default=6, help="designs after which a place is looked for")
    parser.add_argument("--designs", type=int, default=6, help="of both")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    print(
        "| candidate | promised | without: first and last design | with it | seconds |",
        "|---|---|---|---|---|",
        sep="\n",
    )
    for candidate in draw_candidates(load_target(asked.target), asked.candidates, asked.seed):
        suits = not asked.layouts or candidate.layout in asked.layouts
        if suits and candidate.problem is not None and candidate.problem.solid is None:
            print("|", " | ".join((candidate.name, *compared(candidate, asked))), "|", flush=True)


if __name__ == "__main__":
    main()
