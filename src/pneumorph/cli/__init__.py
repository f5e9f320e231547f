"""The `pneumorph` command."""

import contextlib
import sys
import warnings
from typing import Annotated, Any

import typer

import pneumorph as package
from pneumorph.cli import commands
from pneumorph.cli.help import WholeSentences
from pneumorph.cli.usage import UsageError, in_words, shows_help
from pneumorph.errors import ComputationError, Hopeless, ProblemError, Renamed
from pneumorph.interrupts import Interrupted

MOST_FAULTS = 10
"""Faults of a problem file that are shown at once, one line each."""


class Commands(WholeSentences):
    """The commands; the package's own errors end in one line and an exit status instead of a traceback."""

    def make_context(self, *given: Any, **options: Any) -> Any:
        try:
            return super().make_context(*given, **options)
        except UsageError as error:
            raise _misused(error) from None

    def invoke(self, ctx: Any) -> Any:
        warnings.simplefilter("always", Renamed)
        warnings.showwarning = _warn
        try:
            return super().invoke(ctx)
        except UsageError as error:
            raise _misused(error) from None
        except ProblemError as error:
            for fault in error.faults[:MOST_FAULTS]:
                _report(fault)
            if len(error.faults) > MOST_FAULTS:
                _report(f"and {len(error.faults) - MOST_FAULTS} more; correct these first")
            raise typer.Exit(2) from None
        except ComputationError as error:
            _report(error)
            raise typer.Exit(2 if isinstance(error, Hopeless) else 1) from None
        except Interrupted as stop:
            # With SIGHUP, the terminal is gone.
            with contextlib.suppress(OSError):
                _report(stop)
            raise typer.Exit(stop.status) from None


def _misused(error: Any) -> Exception:
    """What ends the command after a mistake in its arguments; a group without any shows its help."""
    if shows_help(error):
        return error
    _report(in_words(error))
    return typer.Exit(2)


def _warn(message: Warning | str, category: type[Warning], *rest: Any) -> None:
    """Report renamed keys in one line, warnings of libraries as Python does, and of kernels in caches nothing."""
    if issubclass(category, Renamed):
        _report(message)
        return
    if "jax" in sys.modules:
        # Loaded by whatever has used jax.
        from pneumorph.numerics import tells_of_kernels

        if tells_of_kernels(str(message)):
            return
    print(warnings.formatwarning(message, category, *rest[:2]), file=sys.stderr)


def _report(error: BaseException | str) -> None:
    """Print a message in one line, even if a name or value in it has several."""
    print("pneumorph:", " ".join(str(error).split()), file=sys.stderr)


# Without markup in help: it takes words in square brackets, such as [material], for styles and leaves them out.
app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _version(asked: bool) -> None:
    if asked:
        print(f"pneumorph {package.__version__}")
        raise typer.Exit


@app.callback()
def pneumorph(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Design pneumatic soft robots: from a target motion to the body, its air chambers and its pressures."""


app.command()(commands.new)
app.command()(commands.design)
app.command()(commands.simulate)
app.command()(commands.check)
app.command()(commands.accuracy)
app.command()(commands.reach)
app.command()(commands.model)
app.command()(commands.workspace)
app.command()(commands.tolerance)
app.command()(commands.calibrate)
app.command()(commands.validate)
app.command()(commands.export)
app.command()(commands.report)
app.command()(commands.draw)
app.command()(commands.view)
app.command()(commands.make)
app.add_typer(commands.material, name="material")
app.command()(commands.study)
app.command()(commands.propose)
app.command()(commands.verify)
app.command()(commands.warm_up)
