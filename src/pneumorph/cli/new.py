"""`pneumorph new`: write a commented problem file to start from."""

from __future__ import annotations

import re
from pathlib import Path

from pneumorph.errors import ProblemError
from pneumorph.problem.starts import KINDS, text_of


def new(name: Path, kind: str) -> None:
    """Write the problem file of a kind; a file that exists is left as it is.

    Raises
    ------
    ProblemError
        If there is no such kind, there is a file of this name already, or it cannot be written.
    """
    if kind not in KINDS:
        raise ProblemError(f'--kind: "{kind}" is not known; use one of {", ".join(KINDS)}')
    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    title = re.sub(r"[\x00-\x1f\x7f\"\\]", "", path.stem.replace("_", " ")).strip()
    text = text_of(kind)
    if title:
        text = re.sub(
            r'^title = ".*"$', lambda _: f'title = "{title[:1].upper()}{title[1:]}"', text, flags=re.MULTILINE
        )
    shown = f'"{path}"' if " " in str(path) else str(path)
    text = re.sub(r"^(#     pneumorph \w+) FILE$", lambda found: f"{found[1]} {shown}", text, flags=re.MULTILINE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ProblemError(f"{path}: its folder cannot be made ({error.strerror}); give another name") from None
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ProblemError(f"{path}: there is already a file of this name; give another name") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ProblemError(f"{path}: cannot be written ({why}); give another name") from None
    print(f"written to {path}; change it, then: pneumorph check {shown}")
