"""The documentation site: its navigation, the reference of the problem file, and the problems on its pages."""

import importlib.util
import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import pneumorph as pm
from pneumorph.problem.contact import TriangulatedSpec
from pneumorph.problem.envelope import Envelope
from pneumorph.problem.objectives import Custom
from pneumorph.problem.schema import json_schema
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.table import Table, described

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
MADE = {"readme.md", "architecture.md", "changelog.md", "contributing.md", "security.md", "file_reference.md"}
"""Pages of the site that are made when it is built: see docs/hooks/site.py."""
LINK = re.compile(r'\]\(([^)\s]+)\)|src="([^"]+)"')
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)


def file_reference() -> str:
    """The page, as the site's hook makes it."""
    spec = importlib.util.spec_from_file_location("file_reference", DOCS / "hooks" / "file_reference.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.page(json.loads(json_schema()))


def tables(of: type[Table] = Table) -> list[type[Table]]:
    """All tables of a problem file that are not only the base of others."""
    below = of.__subclasses__()
    only_base = bool(below) and of.__name__ not in json.loads(json_schema())["$defs"]
    here = [] if of is Table or only_base or not of.__module__.startswith("pneumorph.problem") else [of]
    return here + [table for one in below for table in tables(one)]


def keys_by_section(page: str) -> dict[str, dict[str, list[str]]]:
    """Cells of every row by the section's anchor (of the first section: "") and the key."""
    found: dict[str, dict[str, list[str]]] = {}
    for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        heading, _, text = section.partition("\n")
        anchor = re.search(r"\{ #table-(\w+) \}", heading)
        rows = [re.split(r" (?<!\\)\| ", row[2:-2]) for row in text.splitlines() if row.startswith("| `")]
        found[anchor[1] if anchor else ""] = {cells[0].strip("`"): cells for cells in rows}
    return found


def test_reference_lists_every_key():
    sections = keys_by_section(file_reference())
    assert len(tables()) >= 25
    assert len(sections) == len(tables())
    for table in tables():
        rows = sections["" if table is pm.Problem else table.__name__.lower()]
        assert list(rows) == [
            *table.model_fields,
            *(["file"] if table in (Custom, Envelope, TriangulatedSpec, SolidSpec) else []),
        ], table
        texts = described(table)
        for key, field in table.model_fields.items():
            _, value, _, default, meaning = rows[key]
            assert value and meaning == " ".join(texts[key].split()), f"{table.__name__}.{key}"
            assert ("must be given" in default) == field.is_required(), f"{table.__name__}.{key}"


def test_reference_has_units_and_defaults():
    sections = keys_by_section(file_reference())
    assert sections["limits"]["wall"][1:4] == ['`"… mm"`, not negative', "`mm`", '`"2 mm"`']
    assert sections["spring"]["torsion"][2:4] == ["`N*mm/rad`", '`"0 N*mm/rad"`']
    assert sections["makespec"]["draft"][2:4] == ["`deg`", '`"1 deg"`']
    assert sections["task"]["pressure"][2] == "`kPa`"
    assert sections["custom"]["file"][3] == "this or `code` must be given"
    assert sections["ogden"]["terms"][1] == "list (at least 1, at most 6) of [ogden-term](#table-ogdenterm)"


def test_links_in_the_reference_lead_to_sections():
    page = file_reference()
    assert set(re.findall(r"\]\(#([\w-]+)\)", page)) == set(re.findall(r"\{ #([\w-]+) \}", page))


def paths_of(navigation: list) -> list[str]:
    """All pages of a navigation."""
    found = []
    for entry in navigation:
        for value in entry.values() if isinstance(entry, dict) else [entry]:
            found += paths_of(value) if isinstance(value, list) else [value]
    return found


def test_every_page_is_in_the_navigation():
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    listed = paths_of(settings["nav"])
    assert sorted(listed) == sorted(set(listed))
    assert set(listed) == {page.relative_to(DOCS).as_posix() for page in PAGES} | MADE
    assert settings["strict"] and settings["theme"]["font"] is False


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page):
    """In the repository; building the site checks them there."""
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    for link in (one or other for one, other in LINK.findall(text)):
        target = link.partition("#")[0]
        if target and ":" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {link}"


def problems() -> list[tuple[str, str]]:
    """Whole problem files on the pages, with the names of their pages."""
    found = []
    for page in PAGES:
        for block in re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            if "[body]" in block and "[[task]]" in block:
                found.append((page.stem, block))
    return found


@pytest.mark.parametrize(("page", "text"), problems(), ids=[page for page, _ in problems()])
def test_problems_on_pages_are_sound(page, text):
    assert pm.Problem(**tomllib.loads(text)).title


def test_every_public_name_is_on_the_page():
    named = re.findall(r"^::: pneumorph\.(\w+)$", (DOCS / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(named) == sorted(pm.__all__)
