"""The design loop: proxy, sub-problem, trust region (the paper's Sections V and VI)."""

from pneumorph.optimize.events import (
    BegunBeyond,
    BegunLower,
    BroughtWithin,
    DesignAccepted,
    DesignRejected,
    Divided,
    Event,
    Finished,
    MeshKept,
    NotDivided,
    NotRefined,
    Refined,
    Remeshed,
    Served,
    Started,
)
from pneumorph.optimize.loop import design, optimise
from pneumorph.optimize.setup import Setup, build_setup, setup_among

__all__ = [
    "BegunBeyond",
    "BegunLower",
    "BroughtWithin",
    "DesignAccepted",
    "DesignRejected",
    "Divided",
    "Event",
    "Finished",
    "MeshKept",
    "NotDivided",
    "NotRefined",
    "Refined",
    "Remeshed",
    "Served",
    "Setup",
    "Started",
    "build_setup",
    "design",
    "optimise",
    "setup_among",
]
