"""Reading problem files into a valid `Problem`, or into an error of one readable line."""

import tomllib
from pathlib import Path

from pneumorph.errors import ProblemError
from pneumorph.problem.whole import Problem


def load(path: str | Path) -> Problem:
    """Read a problem file.

    Raises
    ------
    ProblemError
        One line: the file or the key in it, what is wrong, and how to fix it.

    Examples
    --------
    >>> import pneumorph as pm
    >>> problem = pm.load("examples/small.toml")
    >>> problem.body.length  # mm
    24.0
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except IsADirectoryError:
        raise ProblemError(f"{path}: is a directory; give the problem file in it") from None
    except UnicodeDecodeError:
        raise ProblemError(f"{path}: is not UTF-8 text; save it as UTF-8") from None
    except (OSError, ValueError) as error:
        raise ProblemError(f"{path}: cannot be read ({error}); check the path and its permissions") from None
    return loads(text, where=str(path), folder=path.parent)


def loads(text: str, where: str = "problem", folder: str | Path = ".") -> Problem:
    """Read a problem from text; `where` names it in messages, and files it refers to are looked up in `folder`.

    Raises ProblemError as `load` does.
    """
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ProblemError(f"{where}: is not TOML ({' '.join(str(error).split())}); fix it there") from None
    if not data:
        raise ProblemError(f"{where}: is empty; start from a file in examples/")
    return Problem.model_validate(data, context={"folder": folder})
