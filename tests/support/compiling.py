"""Tests in several processes compile each kernel once: the first does, the others wait and read what it has written."""

from pathlib import Path

from filelock import FileLock
from numba.core.dispatcher import Dispatcher


def share_kernels(folder: Path) -> None:
    """Let all processes that call it with the same folder wait for each other's kernels."""
    folder.mkdir(exist_ok=True)
    compile_alone = Dispatcher.compile

    def compile_or_wait(self, sig):
        code = self.py_func.__code__
        with FileLock(folder / f"{Path(code.co_filename).stem}-{code.co_firstlineno}"):
            return compile_alone(self, sig)

    Dispatcher.compile = compile_or_wait
