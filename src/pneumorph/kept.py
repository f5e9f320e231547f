"""Kernels that Numba keeps in files: where these cannot be read or written, kernels are compiled, as without files.

Imported before the first kernel is defined. Numba itself raises where a file ends early, as after a crash or on a full
disk, and where neither the package's folder nor the user's cache folder can be written.
"""

from __future__ import annotations

import contextlib
from typing import Any

from numba.core import caching, dispatcher


class Kept(caching.FunctionCache):
    """The files of one kernel."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """A compiled kernel; None where there is none that can be read, after which the next one can be kept again."""
        try:
            return super().load_overload(sig, target_context)
        # Whatever unpickling and linking make of what is no kernel.
        except Exception:
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel where that is possible."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


def _files_of(function: Any) -> caching._Cache:
    try:
        return Kept(function)
    except RuntimeError:
        # There is no folder that can be written.
        return caching.NullCache()


dispatcher.FunctionCache = _files_of  # pyright: ignore[reportAttributeAccessIssue]
