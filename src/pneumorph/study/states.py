"""Exact states on Dask workers: each meshes the body itself, and finds states from those that it has found before."""

from __future__ import annotations

import os
import pickle
from collections.abc import Sequence

import numpy as np
from distributed import Client, Future

from pneumorph.errors import ComputationError
from pneumorph.study.in_turn import in_turn, threads_of
from pneumorph.surrogate.states import Missing, Sample, States

ROUND = 4
"""States for every worker in a round, after which the domain may be smaller."""

_OWN: dict[str, States] = {}
"""Of this worker, by the search that they belong to."""


class StatesOnWorkers:
    """Finds states as `States` does, several at a time.

    Parameters
    ----------
    client : Client
        Of Dask, with its workers.
    states : States
        Which has found none yet.
    """

    def __init__(self, client: Client, states: States) -> None:
        self.names, self.bounds = states.names, states.bounds
        self.at_once = ROUND * threads_of(client)
        self._client, self._key = client, os.urandom(8).hex()
        # As bytes: what workers have solved with cannot be sent on to others.
        self._states = client.scatter(pickle.dumps(states), broadcast=True)
        self.solved = self.factorisations = self.dofs = 0

    def all_searched(self, points: Sequence[np.ndarray], base: np.ndarray) -> list[Sample | Missing]:
        """The states at points (n, C), or those before which there are none; see `States.searched`.

        Raises
        ------
        ComputationError
            If a worker fails.
        """
        tasks = (
            (place, self._client.submit(_searched, self._key, self._states, point, base, pure=False))
            for place, point in enumerate(points)
        )
        found: dict[int, Sample | Missing] = {}
        for place, future in in_turn(self._client, tasks):
            found[place], solved, factorisations, self.dofs = _result(future)
            self.solved, self.factorisations = self.solved + solved, self.factorisations + factorisations
        return [found[place] for place in range(len(points))]


def _result(future: Future) -> tuple[Sample | Missing, int, int, int]:
    try:
        return future.result()
    except Exception as error:
        raise ComputationError(f"a worker failed ({type(error).__name__}: {error})".splitlines()[0]) from None


def _searched(key: str, states: bytes, point: np.ndarray, base: np.ndarray) -> tuple[Sample | Missing, int, int, int]:
    """A state, and what it cost."""
    if key not in _OWN:
        _OWN.clear()
        _OWN[key] = pickle.loads(states)
    own = _OWN[key]
    before = own.solved, own.factorisations
    answer = own.searched(point, base)
    return answer, own.solved - before[0], own.factorisations - before[1], own.dofs
