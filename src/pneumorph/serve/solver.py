"""Demands for equilibria: the newest goes to the worker at once, sweeps fill the time between, answers are kept."""

from __future__ import annotations

import multiprocessing
import threading
from collections import OrderedDict
from collections.abc import Iterable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from pneumorph.processes import without_working_directory
from pneumorph.serve.worker import Answer, RequestedState, failure, work

MOST_ANSWERS = 200
"""Answers that are kept; of a large mesh each takes about a megabyte."""

LOST = "the solver's process has ended; there may be too little memory for this mesh"


class Solver:
    """A worker process with the demands for it. All methods can be called from any thread."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._answers: OrderedDict[RequestedState, Answer] = OrderedDict()
        self._demand: RequestedState | None = None
        self._sweep: list[RequestedState] = []
        self._sent: RequestedState | None = None
        self._sweeping = False
        self._connection: Connection | None = None
        self._process: BaseProcess | None = None

    def ask(self, wanted: RequestedState) -> Answer | None:
        """Wait for an equilibrium; None once a newer demand has come before it was found."""
        with self._changed:
            if wanted in self._answers:
                return self._answers[wanted]
            self._demand = wanted
            if self._sent != wanted:
                self._send(wanted, sweeping=False)
            self._changed.notify_all()
            self._changed.wait_for(lambda: wanted in self._answers or self._demand != wanted)
            return self._answers.get(wanted)

    def sweep(self, wanted: Iterable[RequestedState]) -> None:
        """Solve these one after another while nobody asks for anything, in place of the sweep before."""
        with self._changed:
            self._sweep = [each for each in wanted if each not in self._answers and each != self._sent]
            self._go_on()

    def known(self, like: RequestedState) -> list[tuple[RequestedState, Answer]]:
        """The answers that are there for the same design."""
        with self._changed:
            same = (like.path, like.design, like.written)
            return [pair for pair in self._answers.items() if (pair[0].path, pair[0].design, pair[0].written) == same]

    @property
    def left(self) -> int:
        """How many states of the sweep are still to be solved."""
        with self._changed:
            return len(self._sweep) + (self._sweeping and self._sent is not None)

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._changed:
            process, connection = self._process, self._connection
            self._process = self._connection = self._demand = self._sent = None
            self._sweep.clear()
            self._changed.notify_all()
        if process is not None and connection is not None:
            process.kill()
            process.join()
            connection.close()

    def _send(self, wanted: RequestedState, sweeping: bool) -> None:
        """Give the worker something to do; what it was sweeping comes later."""
        if self._sent is not None and self._sweeping:
            self._sweep.insert(0, self._sent)
        self._sent, self._sweeping = wanted, sweeping
        try:
            self._started().send(wanted)
        except OSError:
            self._keep(wanted, failure(LOST))
            self._sent = None

    def _go_on(self) -> None:
        """Sweep on where the worker has nothing to do."""
        while self._sent is None and self._sweep:
            wanted = self._sweep.pop(0)
            if wanted not in self._answers:
                self._send(wanted, sweeping=True)

    def _started(self) -> Connection:
        if self._connection is None:
            # A fresh process: threads and compiled kernels do not survive a fork.
            context = multiprocessing.get_context("spawn")
            self._connection, other = context.Pipe()
            self._process = process = context.Process(target=work, args=(other,), daemon=True)
            with without_working_directory():
                process.start()
            other.close()
            threading.Thread(target=self._listen, args=(self._connection,), daemon=True).start()
        return self._connection

    def _listen(self, connection: Connection) -> None:
        """Take in what the worker sends, until it ends."""
        while True:
            try:
                wanted, answer = connection.recv()
            except (EOFError, OSError):
                break
            with self._changed:
                self._take(wanted, answer)
        with self._changed:
            if self._connection is connection:
                self._connection = self._process = None
                lost, self._sent = self._sent, None
                self._sweep.clear()
                if lost is not None:
                    self._keep(lost, failure(LOST))
                self._changed.notify_all()

    def _take(self, wanted: RequestedState, answer: Answer | None) -> None:
        if answer is not None:
            self._keep(wanted, answer)
        if wanted == self._sent:
            self._sent = None
            if self._sweeping and answer is not None and not answer.converged:
                # Further up the sweep there is nothing either.
                self._sweep.clear()
            self._go_on()
        self._changed.notify_all()

    def _keep(self, wanted: RequestedState, answer: Answer) -> None:
        self._answers[wanted] = answer
        while len(self._answers) > MOST_ANSWERS:
            self._answers.popitem(last=False)
