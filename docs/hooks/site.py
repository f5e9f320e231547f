"""What mkdocs does not do by itself: pages and files from outside docs, the file reference, and links between them.

Links are written for the repository, where they work as they are; on the site a file has another place only if it lies
beside or above docs.
"""

import json
import posixpath
import re
from pathlib import Path

from file_reference import page
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from pneumorph.problem.schema import json_schema

ROOT = Path(__file__).parents[2]
PAGES = {
    "README.md": "readme.md",
    "ARCHITECTURE.md": "architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
}
"""Pages of the repository's root, and where they are on the site."""
SCHEMA = "src/pneumorph/problem/schema.json"
"""On the site, a link to it leads to the page that is made from it."""
PLACES = PAGES | {SCHEMA: "file_reference.md"}
CARRIED = ("examples/**/*.toml", "examples/**/*.csv", "notebooks/*.ipynb", "benchmarks/*.py", "CITATION.cff", "LICENSE")
"""Other files that pages link to."""
LINK = re.compile(r'(?<=\]\()[^)\s]+(?=\))|(?<=src=")[^"]+(?=")')
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is not in docs."""
    for name, target in PAGES.items():
        files.append(File.generated(config, target, content=(ROOT / name).read_text(encoding="utf-8")))
    for pattern in CARRIED:
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            files.append(File.generated(config, name, abs_src_path=str(path)))
    files.append(File.generated(config, PLACES[SCHEMA], content=page(json.loads(json_schema()))))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point the links of a page to where the files are on the site."""
    here = page.file.src_uri
    origin = next((name for name, target in PAGES.items() if target == here), f"docs/{here}")

    def moved(match: re.Match[str]) -> str:
        link, _, anchor = match[0].partition("#")
        if not link or ":" in link:
            return match[0]
        target = posixpath.normpath(posixpath.join(posixpath.dirname(origin), link))
        place = PLACES.get(target, target.removeprefix("docs/"))
        if not files.get_file_from_path(place):
            raise PluginError(f"{origin}: {match[0]} is not on the site ({place})")
        return posixpath.relpath(place, posixpath.dirname(here) or ".") + (f"#{anchor}" if anchor else "")

    pieces = CODE.split(markdown)
    pieces[::2] = [LINK.sub(moved, piece) for piece in pieces[::2]]
    return "".join(pieces)
