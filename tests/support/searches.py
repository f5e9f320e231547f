"""A search on bodies so small that each design takes a second."""

from dataclasses import replace

from pneumorph.proposals import Plan, Target
from pneumorph.study.members import run_member

TARGET = Target.model_validate(
    {
        "material": {"name": "Hei-Cast 8400"},
        "space": {"length": "20 mm", "radius": "9 mm"},
        "pressure": {"max": "60 kPa"},
        "task": [{"name": "bend", "objective": {"motion": "bending_y"}}],
        "limits": {"wall": "1.5 mm"},
    }
)


FEW = Plan(candidates=4, seed=1, minutes=60.0, stages=(1, 2), designs=2)


class Runner:
    """Runs members one by one in this process, and remembers their names; their last designs need not be looked at."""

    def __init__(self, out, looking=True):
        self.out, self.looking, self.names = out, looking, []

    def __call__(self, members, drawn):
        for member, settings in members:
            own = replace(settings, looked_at=settings.looked_at and self.looking)
            self.names.append(member.name)
            where = str(self.out / member.name)
            yield run_member(member.name, member.problem, where, lambda *_: None, False, member.begin, own)
