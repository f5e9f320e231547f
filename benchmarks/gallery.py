"""Make the pictures of the documentation, and its tables of the examples, from run directories.

    python benchmarks/gallery.py RUNS [--docs DOCS]

RUNS is a folder with a run directory for every example, by the name of its file (linear, arm_planar, …), and the
directories of the studies (starts, stiffness_bending). Pictures are drawn again from what the runs have stored and
copied to DOCS/images; lines of the tables in DOCS/actuators.md and DOCS/arms.md are replaced by those of the runs. The
page of a run and the served page are taken from a browser (Chromium and Playwright). Nothing is designed or solved, but
for the state at 45 kPa in the served page. What is not there is named, and its old pictures stay.
"""

import argparse
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from table import row

from pneumorph.output.pictures import run_pictures
from pneumorph.output.report import write_report
from pneumorph.run import open_run
from pneumorph.serve.server import Server

PICTURES = {
    "linear": {
        "start": "start.png",
        "final": "final.png",
        "history": "history.png",
        "profile": "profile.png",
        "inflation": "inflation.gif",
    },
    "linear_spring": {"spring": "final.png"},
    "bending": {"bending": "final.png"},
    "bending_spring": {"bending_spring": "final.png"},
    "twisting": {"twisting": "final.png"},
    "twisting_spring": {"twisting_spring": "final.png"},
    "arm_planar": {"arm_planar": "final.png", "arm_planar_shape": "shape.png"},
    "arm_spatial": {"arm_spatial": "final.png", "arm_spatial_shape": "shape.png"},
    "arm_series": {
        "arm_series": "final.png",
        "arm_series_shape_rise": "shape_rise.png",
        "arm_series_shape_arch": "shape_arch.png",
        "arm_series_pressures": "pressures.png",
    },
    "arm_parallel": {"arm_parallel": "final.png", "arm_parallel_pressures": "pressures.png"},
}
"""For every example the pictures of the documentation, and which of its run each is."""

SHEETS = {"starts": "study_starts", "stiffness_bending": "study_stiffness"}
TABLES = ("actuators.md", "arms.md")
COMPARED = ("linear", "bending", "twisting")
"""Runs in the picture of several runs in one view."""

DRAWING = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


def replaced(text: str, rows: dict[str, str]) -> str:
    """The text with lines of tables, by what their first cell says, in place of those that are there."""
    lines = []
    for line in text.splitlines(keepends=True):
        name = line.split("|")[1].strip() if line.startswith("| ") and line.count("|") > 8 else ""
        lines.append(f"{rows[name]}\n" if name in rows else line)
    return "".join(lines)


def draw(runs: Path, images: Path) -> Iterator[str]:
    """Draw the pictures of all examples that are there; yields the names of the others."""
    for name, wanted in PICTURES.items():
        if not (runs / name / "problem.toml").exists():
            yield name
            continue
        drawn = run_pictures(open_run(runs / name))
        for sentence in drawn.missing:
            print(sentence)
        for image, picture in wanted.items():
            source = runs / name / "pictures" / picture
            if source in drawn.paths:
                shutil.copyfile(source, images / f"{image}{source.suffix}")
                print(f"{image}{source.suffix} from {name}")
    for name, image in SHEETS.items():
        sheet = runs / name / "sheet.png"
        if sheet.exists():
            shutil.copyfile(sheet, images / f"{image}.png")
            print(f"{image}.png from {name}")
        else:
            yield name


@contextmanager
def serving(*paths: Path) -> Iterator[str]:
    """The address at which these runs are served."""
    server = Server(paths)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
    try:
        yield server.address
    finally:
        server.shutdown()
        server.close()


def photograph(runs: Path, images: Path) -> None:
    """Take the pictures of pages in a browser."""
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        print("there is no Chromium, so the pictures of pages are as before")
        return
    there = [runs / name for name in COMPARED if (runs / name / "problem.toml").exists()]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=DRAWING)
        page = browser.new_page(viewport={"width": 1280, "height": 900})

        def take(address: str, image: str, ready: str = "body[data-ready]") -> None:
            page.goto(address)
            page.wait_for_selector("body[data-ready]")
            if image == "view":
                # With the numbers of the state.
                page.set_viewport_size({"width": 1280, "height": 1120})
                page.select_option("#task", "*")
                page.locator("#chamber-0").fill("45")
            page.wait_for_selector(ready, timeout=600_000)
            if image == "compare":
                page.locator("#comparison").scroll_into_view_if_needed()
                page.evaluate("document.querySelector('#comparison').scrollIntoView()")
            # The next frames draw what was chosen.
            page.wait_for_timeout(1500)
            page.screenshot(path=images / f"{image}.png")
            page.set_viewport_size({"width": 1280, "height": 900})
            print(f"{image}.png from a browser")

        take(write_report(open_run(runs / "linear")).resolve().as_uri(), "report")
        with serving(runs / "linear") as address:
            take(address, "view", "#explore[data-solved='A 45.000']")
        if len(there) > 1:
            with serving(*there) as address:
                take(address, "compare")
        browser.close()


def main() -> None:
    asked = argparse.ArgumentParser(description="Make the pictures and tables of the documentation from runs.")
    asked.add_argument("runs", type=Path)
    asked.add_argument("--docs", type=Path, default=Path(__file__).parents[1] / "docs")
    given = asked.parse_args()
    images = given.docs / "images"
    missing = list(draw(given.runs, images))
    rows = {name: row(given.runs / name) for name in PICTURES if name not in missing}
    for table in TABLES:
        path = given.docs / table
        path.write_text(replaced(path.read_text(encoding="utf-8"), rows), encoding="utf-8")
    if "linear" not in missing:
        photograph(given.runs, images)
    if missing:
        print(f"not there, so their pictures and lines are as before: {', '.join(missing)}")


if __name__ == "__main__":
    main()
