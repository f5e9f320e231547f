"""Arguments of the commands. Their implementations are loaded when they are called, so that --help is fast."""

from pneumorph.cli.commands.designing import check, design, new, propose, study
from pneumorph.cli.commands.judging import accuracy, calibrate, tolerance, validate
from pneumorph.cli.commands.materials import fit_material, material
from pneumorph.cli.commands.showing import draw, export, make, report, view
from pneumorph.cli.commands.simulating import simulate, verify, warm_up
from pneumorph.cli.commands.using import model, reach, workspace

__all__ = [
    "accuracy",
    "calibrate",
    "check",
    "design",
    "draw",
    "export",
    "fit_material",
    "make",
    "material",
    "model",
    "new",
    "propose",
    "reach",
    "report",
    "simulate",
    "study",
    "tolerance",
    "validate",
    "verify",
    "view",
    "warm_up",
    "workspace",
]
