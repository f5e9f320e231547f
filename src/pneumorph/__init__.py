"""pneumorph: automatic morphological design of pneumatic soft robots.

    import pneumorph as pm

    run = pm.design("linear.toml", out="runs/linear")
    run.best.simulate({"A": "0:60:5 kPa"}, block="axial").plot()

Importing this package loads nothing else and changes no settings; see `pneumorph.numerics` for what the first use does.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneumorph import bodies
    from pneumorph.analysis import GradientCheck
    from pneumorph.errors import ComputationError, MeshError, PneumorphError, ProblemError
    from pneumorph.interface.beam import BeamFit, fit_beam
    from pneumorph.interface.check import check_gradient
    from pneumorph.interface.design import Design, starting_design
    from pneumorph.interface.material import MaterialFit, fit_material
    from pneumorph.interface.over_time import OverTime
    from pneumorph.interface.propose import propose
    from pneumorph.interface.runs import Run, design, designs, open_run
    from pneumorph.interface.sweep import Sweep
    from pneumorph.interface.validation import Validation, validate
    from pneumorph.limits.report import LimitReading
    from pneumorph.problem import Problem, load, with_fewer_chambers, with_further_chamber
    from pneumorph.proposals import Plan, Proposal, Target
    from pneumorph.results import ChamberUse, HistoryEntry, RunResult, SweepStep, TaskResult, TipStiffness

__version__ = "0.2.0"

__all__ = [
    "BeamFit",
    "ChamberUse",
    "ComputationError",
    "Design",
    "GradientCheck",
    "HistoryEntry",
    "LimitReading",
    "MaterialFit",
    "MeshError",
    "OverTime",
    "Plan",
    "PneumorphError",
    "Problem",
    "ProblemError",
    "Proposal",
    "Run",
    "RunResult",
    "Sweep",
    "SweepStep",
    "Target",
    "TaskResult",
    "TipStiffness",
    "Validation",
    "bodies",
    "check_gradient",
    "design",
    "designs",
    "fit_beam",
    "fit_material",
    "load",
    "open_run",
    "propose",
    "starting_design",
    "validate",
    "with_fewer_chambers",
    "with_further_chamber",
]

_MODULES = {
    "analysis": ("GradientCheck",),
    "errors": ("ComputationError", "MeshError", "PneumorphError", "ProblemError"),
    "interface.beam": ("BeamFit", "fit_beam"),
    "interface.check": ("check_gradient",),
    "interface.design": ("Design", "starting_design"),
    "interface.material": ("MaterialFit", "fit_material"),
    "interface.propose": ("propose",),
    "interface.runs": ("Run", "design", "designs", "open_run"),
    "interface.over_time": ("OverTime",),
    "interface.sweep": ("Sweep",),
    "interface.validation": ("Validation", "validate"),
    "limits.report": ("LimitReading",),
    "problem": ("Problem", "load", "with_fewer_chambers", "with_further_chamber"),
    "proposals": ("Plan", "Proposal", "Target"),
    "results": ("ChamberUse", "HistoryEntry", "RunResult", "SweepStep", "TaskResult", "TipStiffness"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load the module of a public name when it is first used."""
    if name == "bodies":
        return import_module(f"{__name__}.bodies")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
