"""Arguments that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RunDirectory = Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")]
Trusted = Annotated[bool, typer.Option("--trust", help="Run the Python code in the file without asking.")]
DesignNumber = Annotated[int | None, typer.Option(min=0, help="Number of the design; by default the last.")]
