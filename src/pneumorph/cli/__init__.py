"""The `pneumorph` command."""

import sys
from typing import Any

import typer
from typer.core import TyperGroup

from pneumorph.cli import check, design, make, material, simulate, study, verify
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.run.cache import use_compilation_cache


class Commands(TyperGroup):
    """The commands; what goes wrong on purpose ends in one line and an exit status instead of a traceback."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except ProblemError as error:
            _tell(error)
            raise typer.Exit(2) from None
        except ComputationError as error:
            _tell(error)
            raise typer.Exit(1) from None


def _tell(error: Exception) -> None:
    """In one line, also where a name or a value that it repeats has several."""
    print("pneumorph:", " ".join(str(error).split()), file=sys.stderr)


app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False)


@app.callback()
def pneumorph() -> None:
    """Shape pneumatic soft robots: from a target motion to the body, its air chambers and its pressures."""
    use_compilation_cache()


app.command()(design.design)
app.command()(simulate.simulate)
app.command()(check.check)
app.command()(make.make)
app.add_typer(material.app, name="material")
app.command()(study.study)
app.command()(verify.verify)
