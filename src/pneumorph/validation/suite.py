"""All published measurements of the package."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from pneumorph.doing import doing
from pneumorph.validation.balloon import balloons
from pneumorph.validation.beam import beams
from pneumorph.validation.comparison import Comparison
from pneumorph.validation.disc import discs

BODIES: Mapping[str, Callable[[bool], Iterator[Comparison]]] = {
    "balloon": balloons,
    "beam": beams,
    "disc": discs,
}
"""What has been measured, and what yields its comparisons, quickly or not."""


def published(names: Sequence[str], quick: bool = False) -> Iterator[Comparison]:
    """The comparisons of some bodies, one after another.

    Parameters
    ----------
    names : of `BODIES`.
    quick : with large elements and steps.

    Raises
    ------
    ComputationError
        If a state is not found that a comparison cannot do without.
    """
    for name in names:
        with doing(f"predicting the {name}"):
            yield from BODIES[name](quick)
