"""The server of the page: on the loopback interface alone, and for nobody who does not know its secret address.

The address has a random token, so that other users of the machine cannot read the runs. A request must name a loopback
host, so that a foreign name that leads here does not; and one that a page makes must come from this server's own.
"""

from __future__ import annotations

import json
import secrets
import signal
import sys
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from pneumorph.errors import ProblemError
from pneumorph.interrupts import Interrupted, deferred, stop_if_asked
from pneumorph.output.report import served_page
from pneumorph.serve.live import LiveRun
from pneumorph.serve.solver import Solver

LOOPBACK = "127.0.0.1"
OWN_NAMES = (LOOPBACK, "localhost")
MOST_RUNS = 8
"""Runs in one view: each is drawn, and browsers draw in few places at once."""

MOST_BODY = 20_000
"""Bytes of a request's body."""


class Refused(Exception):
    """A request that gets a status and one line instead of what it asked for."""

    def __init__(self, status: HTTPStatus, reason: str):
        super().__init__(reason)
        self.status = status


class Server(ThreadingHTTPServer):
    """Serves runs on a port of this machine, by default any free one.

    Raises
    ------
    ProblemError
        If a path is not a run directory, there are too many, or the port cannot be used.
    """

    daemon_threads = True
    # A browser that restores several pages opens all its connections at once.
    request_queue_size = 128
    block_on_close = False

    def __init__(self, paths: Sequence[Path], port: int = 0):
        if len(paths) > MOST_RUNS:
            raise ProblemError(f"{len(paths)} runs: at most {MOST_RUNS} are shown in one view; name fewer")
        self.runs = [LiveRun(path) for path in paths]
        self.token = secrets.token_urlsafe(16)
        self.solver = Solver()
        self.closed = False
        try:
            super().__init__((LOOPBACK, port), Handler)
        except (OSError, OverflowError) as error:
            words = error.strerror if isinstance(error, OSError) else "not a port"
            raise ProblemError(f"--port {port}: cannot be used ({words}); leave it out to have a free one") from None

    @property
    def address(self) -> str:
        """The address to open in a browser."""
        return f"http://{LOOPBACK}:{self.server_address[1]}/{self.token}/"

    def serve_until_interrupted(self) -> None:
        """Serve until Ctrl-C, which is how this ends; other signals raise Interrupted."""
        try:
            with deferred():
                self.serve_forever(poll_interval=0.2)
        except Interrupted as stop:
            if stop.number != signal.SIGINT:
                raise
        finally:
            self.close()

    def service_actions(self) -> None:
        """Between two looks at the port."""
        stop_if_asked()

    def close(self) -> None:
        """Free the port, leave the browsers that are connected, and end the solver."""
        self.closed = True
        self.server_close()
        self.solver.close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """One line for what goes wrong; that a browser has left is nothing wrong."""
        error = sys.exc_info()[1]
        if not isinstance(error, ConnectionError | TimeoutError):
            print(f"pneumorph: {type(error).__name__}: {' '.join(str(error).split())}", file=sys.stderr)


class Handler(BaseHTTPRequestHandler):
    """A connection of a browser. Runs and designs are named by numbers: no path comes from a request."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "pneumorph", ""
    timeout = 120

    @property
    def _view(self) -> Server:
        assert isinstance(self.server, Server)
        return self.server

    def do_GET(self) -> None:
        self._respond("GET")

    def do_POST(self) -> None:
        self._respond("POST")

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the page asks for news every second."""

    def _respond(self, method: str) -> None:
        if self._view.closed:
            raise ConnectionAbortedError
        status, kind = HTTPStatus.OK, "application/json"
        try:
            # Read in any case, so that the connection can serve the next request.
            body = self._body() if method == "POST" else b""
            self._guard(method)
            kind, content = self._content(method, body)
        except Refused as error:
            status, content = error.status, _json({"error": str(error)})
        except ProblemError as error:
            status, content = HTTPStatus.CONFLICT, _json({"error": " ".join(str(error).split())})
        self.send_response(status)
        headers = {
            "Content-Type": kind,
            "Content-Length": str(len(content)),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Content-Security-Policy": "frame-ancestors 'none'",
        }
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def _guard(self, method: str) -> None:
        """Refuse what does not come from this server's own page."""
        host = self.headers.get("Host", "")
        if host.rpartition(":")[0] not in OWN_NAMES:
            raise Refused(HTTPStatus.FORBIDDEN, "this server answers requests to 127.0.0.1 and localhost only")
        if self.headers.get("Origin", f"http://{host}") != f"http://{host}":
            raise Refused(HTTPStatus.FORBIDDEN, "requests of other sites are refused")
        if self.headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
            raise Refused(HTTPStatus.FORBIDDEN, "requests of other sites are refused")
        if method == "POST" and self.headers.get_content_type() != "application/json":
            raise Refused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "the request must be JSON")

    def _body(self) -> bytes:
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdecimal() and len(length) < 9 and int(length) <= MOST_BODY):
            self.close_connection = True
            raise Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"the request must have at most {MOST_BODY} bytes")
        return self.rfile.read(int(length))

    def _content(self, method: str, body: bytes) -> tuple[str, bytes]:
        """What a path leads to: its kind and its content."""
        server = self._view
        token, *names = urlsplit(self.path).path.removeprefix("/").split("/")
        if not secrets.compare_digest(token.encode(), server.token.encode()):
            raise Refused(HTTPStatus.NOT_FOUND, "this address is not the one that pneumorph view printed")
        match method, names:
            case "GET", [""]:
                return "text/html; charset=utf-8", served_page("pneumorph view").encode()
            case "GET", ["runs"]:
                runs = [{"name": name, "title": run.title, "stamp": run.stamp()} for name, run in _named(server.runs)]
                return "application/json", _json(runs)
            case "GET", ["runs", number]:
                return "application/octet-stream", _chosen(server.runs, number).block()
            case "POST", ["runs", number, "designs", design, "sweep" | "state" as what]:
                run, place, asked = _chosen(server.runs, number), _whole(design), _object(body)
                if what == "state":
                    return "application/octet-stream", self._state(run, place, asked)
                return "application/json", _json(self._sweep(run, place, asked.get("start") is True))
        raise Refused(HTTPStatus.NOT_FOUND, "there is no page or file of this name")

    def _sweep(self, run: LiveRun, design: int, start: bool) -> dict[str, Any]:
        """What is known of a design in kPa, and how much of the sweep is left; `start` has it solved."""
        solver, wanted = self._view.solver, run.sweep(design)
        if start:
            solver.sweep(wanted)
        known = [
            {name: 1e3 * value for name, value in each.pressures}
            for each, answer in solver.known(wanted[0])
            if answer.converged
        ]
        return {"known": known, "left": solver.left}

    def _state(self, run: LiveRun, design: int, pressures: dict[str, Any]) -> bytes:
        """The block of a state at pressures in kPa; nothing where a newer demand came first."""
        answer = self._view.solver.ask(run.wanted(design, pressures))
        return b"" if answer is None else answer.block


def _named(runs: Sequence[LiveRun]) -> list[tuple[str, LiveRun]]:
    """Runs with the ends of their paths that tell them apart."""
    parts, names = 1, [run.path.name for run in runs]
    while len(set(names)) < len(set(run.path for run in runs)):
        parts += 1
        names = ["/".join(run.path.parts[-parts:]) for run in runs]
    return list(zip(names, runs, strict=True))


def _chosen(runs: Sequence[LiveRun], number: str) -> LiveRun:
    place = _whole(number)
    if place >= len(runs):
        raise Refused(HTTPStatus.NOT_FOUND, f"there is no run {place}")
    return runs[place]


def _whole(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 7):
        raise Refused(HTTPStatus.NOT_FOUND, "runs and designs are named by whole numbers")
    return int(text)


def _object(body: bytes) -> dict[str, Any]:
    try:
        content = json.loads(body)
    except (RecursionError, ValueError):
        content = None
    if not isinstance(content, dict):
        raise Refused(HTTPStatus.BAD_REQUEST, "the request must be a JSON object")
    return content


def _json(content: Any) -> bytes:
    return json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
