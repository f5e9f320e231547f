"""How the examples of a fuzzed property ended."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """What an example led to: a word, the reason, the seconds it took; `broken` says which promise it broke."""

    verdict: str
    reason: str
    seconds: float
    example: str
    broken: str = ""


@dataclass
class Tally:
    """The outcomes of one property."""

    name: str
    outcomes: list[Outcome] = field(default_factory=list)

    def add(self, outcome: Outcome) -> None:
        """Count an outcome, and say it: pytest -s shows a long run as it goes."""
        self.outcomes.append(outcome)
        words = f"{outcome.seconds:.1f} s, {outcome.verdict}: {outcome.reason}"
        print(
            f"{self.name} {len(self.outcomes)}: {words[:200]}{f' BROKEN: {outcome.broken}' if outcome.broken else ''}"
        )

    @property
    def broken(self) -> list[Outcome]:
        return [outcome for outcome in self.outcomes if outcome.broken]

    def complaint(self) -> str:
        """Every broken promise with the example that broke it."""
        return "\n\n".join(f"{one.broken} ({one.verdict}: {one.reason})\n{one.example}" for one in self.broken)

    def table(self) -> list[str]:
        """The outcomes counted, numbers in their reasons left out."""
        groups: dict[tuple[str, str], list[float]] = defaultdict(list)
        for one in self.outcomes:
            reason = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", one.reason)
            groups[one.verdict, re.sub(r"(\w+ = # kPa, )*\w+ = # kPa", "# kPa", reason)].append(one.seconds)
        seconds = [one.seconds for one in self.outcomes]
        lines = [
            f"{self.name}: {len(seconds)} examples in {sum(seconds):.0f} s, slowest {max(seconds, default=0):.1f} s"
        ]
        lines.append(f"{'count':>6} {'slowest':>8}  outcome")
        for (verdict, reason), spent in sorted(groups.items(), key=lambda item: -len(item[1])):
            lines.append(f"{len(spent):6} {max(spent):6.1f} s  {verdict}{f': {reason}' if reason else ''}"[:160])
        return [*lines, f"{len(self.broken)} broke a promise"]
