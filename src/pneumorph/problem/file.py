"""Reading problem files into a valid `Problem`, or into an error of one readable line."""

from pathlib import Path
from shlex import quote

from pneumorph.errors import ProblemError
from pneumorph.problem.reading import parse_toml, read_toml
from pneumorph.problem.trust import Trust, admit, codes_of
from pneumorph.problem.whole import Problem


def load(path: str | Path, trust: Trust = False) -> Problem:
    """Read a problem file.

    Parameters
    ----------
    path : Path
    trust : bool
        Whether code in the file is trusted: an objective of kind "custom" is Python code, which the functions that
        compute will run with all rights of the user. Only needed once for the same code. May also be a function that is
        asked, with the name of the file and the pieces of code in it that are new.

    Raises
    ------
    ProblemError
        One line: the file or the key in it, what is wrong, and how to fix it. Also for code that is not trusted.

    Examples
    --------
    >>> import pneumorph as pm
    >>> problem = pm.load("examples/small.toml")
    >>> problem.body.length  # mm
    24.0
    """
    problem = read(path)
    admit(codes_of(problem), str(path), trust)
    return problem


def read(path: str | Path) -> Problem:
    """Read a problem file as `load` does, but let code in it pass: for those who do not run it, or have asked."""
    path = Path(path)
    return _valid(read_toml(path, str(path), "the problem file"), str(path), path.parent)


def loads(text: str, where: str = "problem", folder: str | Path = ".") -> Problem:
    """Read a problem from text; `where` names it in messages, and files it refers to are looked up in `folder`.

    Code in the text is taken to be the caller's own. Raises ProblemError as `load` does.
    """
    return _valid(parse_toml(text, where), where, folder)


def _valid(data: dict, where: str, folder: str | Path) -> Problem:
    if not data:
        raise ProblemError(f"{where}: is empty; start from a file in examples/")
    if "space" in data and "body" not in data:
        raise ProblemError(
            f"{where}: is a target, which has a space and no body; run: pneumorph propose {quote(where)}"
        )
    return Problem.model_validate(data, context={"folder": folder})
