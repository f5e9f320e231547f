"""The `pneumorph` command, also as `python -m pneumorph`."""

import contextlib
import os
import sys

from pneumorph import compiling, interrupts


def main() -> None:
    """Run the command; signals are received before anything that takes time is loaded."""
    interrupts.install()
    # NumPy and SciPy read it when they are loaded. Products of vectors are shared by threads that then spin for longer
    # than the product takes: a fifth of the processor time of `check`, for matrices that are too small to gain by it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    compiling.announce(_compiling)
    from pneumorph.cli import app

    try:
        app(prog_name="pneumorph")
    except SystemExit as end:
        interrupts.leave(end.code)
        raise


def _compiling() -> None:
    with contextlib.suppress(OSError):
        print("compiling (once)", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
