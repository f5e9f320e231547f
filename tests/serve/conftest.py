"""A run with three designs, and what a server says of it."""

import http.client
import json
import threading
from contextlib import contextmanager

import pytest
from runs import analysed, ended, waving_run
from tiny import tiny

from pneumorph.problem import loads
from pneumorph.serve.server import Server


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    problem = loads(tiny())
    run = waving_run(tmp_path_factory.mktemp("runs") / "run", problem, 3, {0: analysed(problem, 0.0)})
    ended(run)
    return run


@pytest.fixture
def serving():
    """Serves runs: with serving(path, …) as server."""

    @contextmanager
    def serve(*paths):
        server = Server(paths)
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
        try:
            yield server
        finally:
            server.shutdown()
            server.close()

    return serve


@pytest.fixture
def asked():
    """Asks a server: asked(server, "runs") with the token, or with another whole path; status and content."""

    def ask(server, name="", path=None, method="GET", body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=120)
        content = body if body is None or isinstance(body, str) else json.dumps(body)
        kind = {} if body is None else {"Content-Type": "application/json"}
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, f"/{server.token}/{name}" if path is None else path, content, kind | given)
        answer = connection.getresponse()
        found = answer.status, answer.read()
        connection.close()
        return found

    return ask
