"""What tests see and do of a page in a browser."""

import base64
import io
import re
import threading
from contextlib import contextmanager

import matplotlib.image
import numpy as np

from pneumorph.serve.server import Server

SOLVED = "#explore[data-solved='{}']"


@contextmanager
def serving(*paths):
    """The address of a server of runs."""
    server = Server(paths)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
    try:
        yield server.address
    finally:
        server.shutdown()
        server.close()


def picture(page) -> np.ndarray:
    """The pixels (height, width, 3) of the drawn body, without what is written over it."""
    # Two frames: what was chosen is drawn in the next one.
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    content = page.evaluate(
        """() => { const seen = document.querySelector("#view canvas");
        const copy = document.createElement("canvas"); [copy.width, copy.height] = [seen.width, seen.height];
        const pen = copy.getContext("2d"); pen.fillStyle = "white"; pen.fillRect(0, 0, copy.width, copy.height);
        pen.drawImage(seen, 0, 0); return copy.toDataURL("image/png").split(",")[1]; }"""
    )
    return matplotlib.image.imread(io.BytesIO(base64.b64decode(content)))[..., :3]


def blocks_of(path) -> list[bytes]:
    """The packed blocks of a page in a file, one to each run."""
    text = re.search(r'id="block">([^<]*)</script>', path.read_text(encoding="utf-8"))
    assert text is not None
    return [base64.b64decode(block) for block in text[1].split()]


def slide(page, name, value):
    page.locator(f"#{name}").fill(str(value))


def differs(one: np.ndarray, other: np.ndarray) -> float:
    """The part of all pixels that are clearly not the same."""
    return float((np.abs(one - other).max(axis=2) > 0.05).mean())


def words(page, name) -> str:
    return page.locator(f"#{name}").inner_text()


def solved(page, pressures):
    """Wait for the exact state at pressures, as the page writes them."""
    page.wait_for_selector(SOLVED.format(pressures))
