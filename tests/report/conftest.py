"""A browser that draws, and pages to open in it; tests are skipped, with the reason, where there is none."""

import shutil
from contextlib import contextmanager

import pytest
from runs import analysed, ended, waving_run
from tiny import tiny

from pneumorph.output.report import write_report
from pneumorph.problem import loads
from pneumorph.results import Fields

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
HUNG = 600_000
"""Milliseconds after which a page that is waited for is taken to hang."""
# Without a graphics card: bodies are drawn in space as by one, the rest of the page is not, which takes less. As root,
# as in containers, there is no sandbox.
DRAWING = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
DRAWING += ["--disable-gpu-compositing", "--disable-gpu-rasterization"]
FETCHED = "GPU stall due to ReadPixels"
"""What the driver says of that: the browser itself fetches what is drawn in space, without a page that asks for it."""


@pytest.fixture(scope="session")
def launched():
    """Starts the browser with other arguments."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"no browser here: none of {', '.join(BROWSERS)}")
    with api.sync_playwright() as playwright:

        @contextmanager
        def start(*arguments):
            browser = playwright.chromium.launch(executable_path=program, args=list(arguments))
            try:
                yield browser
            finally:
                browser.close()

        yield start


@pytest.fixture(scope="session")
def browser(launched):
    with launched(*DRAWING) as browser:
        yield browser


@pytest.fixture
def plain_browser(launched):
    """One that draws nothing in three dimensions."""
    with launched("--disable-3d-apis", "--no-sandbox") as browser:
        yield browser


@pytest.fixture
def opened(browser):
    """Opens a file without a network, or an address; what the page asks for and complains of is in its lists."""
    contexts = []

    def open_(what, browser=browser, **options):
        address = what if isinstance(what, str) else what.as_uri()
        offline = not isinstance(what, str)
        context = browser.new_context(viewport={"width": 1100, "height": 800}, offline=offline, **options)
        context.set_default_timeout(HUNG)
        contexts.append(context)
        page = context.new_page()
        page.requests, page.complaints = [], []
        page.on("request", lambda request: page.requests.append(request.url))
        page.on("console", lambda message: FETCHED in message.text or page.complaints.append(message.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("dialog", lambda dialog: (page.complaints.append(dialog.message), dialog.dismiss()))
        page.goto(address)
        page.wait_for_selector("body[data-ready]")
        return page

    yield open_
    for context in contexts:
        context.close()


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """Three designs for two tasks, with its page; the last with its way to the pressures."""
    bend = '[[task]]\nname = "half"\npressure = { A = "30 kPa" }\nobjective = { motion = "bending_y" }\n'
    problem = loads(tiny() + bend)
    fields = analysed(problem, 0.6)
    start = analysed(problem, 0.0)
    # As the first design is stored: without the way.
    start = Fields(start.mesh, start.u, start.stretch)
    run = waving_run(tmp_path_factory.mktemp("runs") / "run", problem, 3, {0: start, 2: fields}, waves=0.3)
    ended(run)
    write_report(run)
    return run
