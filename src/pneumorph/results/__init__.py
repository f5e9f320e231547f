"""Results as records and stored fields, and what follows from them without a solution."""

from pneumorph.results.fields import Fields, Inflation, unpack_fields
from pneumorph.results.nodal import nodal_stress, nodal_stretch
from pneumorph.results.objects import from_json, to_json
from pneumorph.results.records import (
    Cause,
    ChamberUse,
    FineResult,
    HistoryEntry,
    Motion,
    MotionRates,
    RunResult,
    Scatter,
    TaskResult,
)
from pneumorph.results.sweeps import Cycle, SweepStep, TipStiffness

__all__ = [
    "Cause",
    "ChamberUse",
    "Cycle",
    "Fields",
    "FineResult",
    "HistoryEntry",
    "Inflation",
    "Motion",
    "MotionRates",
    "RunResult",
    "Scatter",
    "SweepStep",
    "TaskResult",
    "TipStiffness",
    "from_json",
    "nodal_stress",
    "nodal_stretch",
    "to_json",
    "unpack_fields",
]
