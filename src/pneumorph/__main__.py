"""The `pneumorph` command, also as `python -m pneumorph`."""

import contextlib
import errno
import gc
import io
import os
import sys

from pneumorph import compiling, doing, interrupts


def main() -> None:
    """Run the command; signals are received before anything that takes time is loaded."""
    interrupts.install()
    # NumPy and SciPy read it when they are loaded. Products of vectors are shared by threads that then spin for longer
    # than the product takes: a fifth of the processor time of `check`, for matrices that are too small to gain by it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Loading and compiling make millions of objects, few of them in cycles: to look for cycles after every 700 new ones
    # was a seventh of the processor time of a first `check`. What is left of them mostly stays to the end: to look
    # through all of it after ten looks, and not after fifty, took a quarter of a second while the program is loaded.
    gc.set_threshold(20_000, 50)
    compiling.announce(_compiling)
    # What answers at once prints nothing else, however long it takes to load.
    if sys.argv[1:] and not {"--help", "-h", "--version", "--quiet", "-q"} & set(sys.argv):
        doing.announce(_say)
    with doing.doing("loading the program"):
        from pneumorph.cli import app

    # Where the output knows no "≤" or "²", they are written out and nothing is lost.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        try:
            app(prog_name="pneumorph")
        except SystemExit as end:
            interrupts.leave(end.code)
            if sys.stdout is not None:
                sys.stdout.flush()
            raise
    except OSError as error:
        # A file has a name; what has none is the output.
        if error.filename is not None or error.errno not in (errno.ENOSPC, errno.EPIPE) or sys.stdout is None:
            raise
        # Else Python tries again as it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if error.errno == errno.ENOSPC:
            with contextlib.suppress(OSError):
                print(f"pneumorph: standard output: cannot be written ({error.strerror}); make room", file=sys.stderr)
        sys.exit(1)


def _compiling() -> None:
    _say("compiling (once)")
    doing.said()


def _say(sentence: str) -> None:
    with contextlib.suppress(OSError):
        # At once, so that a line of another thread is not mixed with it.
        sys.stderr.write(f"{sentence}\n")
        sys.stderr.flush()


if __name__ == "__main__":
    main()
