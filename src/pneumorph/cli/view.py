"""`pneumorph view`: serve the page of runs to browsers on this machine."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from pneumorph import doing
from pneumorph.cli.trust import asking
from pneumorph.interface.runs import open_run
from pneumorph.serve.server import Server


def view(runs: Sequence[Path], port: int, browser: bool, trust: bool) -> None:
    """Serve runs until Ctrl-C.

    Parameters
    ----------
    runs : sequence of Path
        Run directories.
    port : int
        On this machine; 0 for a free one.
    browser : bool
        Whether the page is opened in a browser.
    trust : bool
        Whether code in problem files is trusted.

    Raises
    ------
    ProblemError
        If a directory is not a run, or the port cannot be used.
    """
    for path in runs:
        open_run(path, asking(trust))
    server = Server(runs, port)
    print(f"{', '.join(map(str, runs))} at {server.address} (Ctrl-C ends it)", flush=True)
    if browser and not (_has_windows() and webbrowser.open(server.address)):
        print("no browser could be opened here; open the address in one on this machine", flush=True)
    doing.announce(None)  # it waits for requests
    server.serve_until_interrupted()


def _has_windows() -> bool:
    """Whether a browser would open in a window of its own, and not in this terminal."""
    return sys.platform != "linux" or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
