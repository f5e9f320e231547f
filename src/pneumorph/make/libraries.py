"""Loading the libraries of the extra ``cad``, with OpenCASCADE beside Netgen's."""

import os
import sys
from importlib import import_module

from pneumorph import extras


def load() -> None:
    """Load OpenCASCADE.

    Raises
    ------
    ModuleNotFoundError
        If a library is not installed; the message says how to install it.
    """
    if words := extras.missing("cad", "making files"):
        raise ModuleNotFoundError(words)
    if sys.platform != "linux":
        import_module("OCP.BRep")
        return
    # Netgen brings another release of OpenCASCADE and makes its symbols global. Bound to those symbols OCP crashes the
    # process, so it is loaded such that it looks for symbols in its own libraries first; and after Netgen, because
    # symbols that OCP has not bound yet would later be found among Netgen's.
    import_module("netgen.meshing")
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
    try:
        import_module("OCP.BRep")
    finally:
        sys.setdlopenflags(flags)
