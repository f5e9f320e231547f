"""The libraries of the extra ``cad``: whether they are installed, and loading OpenCASCADE beside Netgen's."""

import os
import sys
from importlib import import_module
from importlib.util import find_spec


def load() -> None:
    """Load OpenCASCADE.

    Raises
    ------
    ModuleNotFoundError
        If a library is not installed; the message says how to install it.
    """
    missing = [library for library in ("OCP", "manifold3d", "lib3mf") if find_spec(library) is None]
    if missing:
        words = f"making files needs {', '.join(missing)}; install with: pip install 'pneumorph[cad]'"
        raise ModuleNotFoundError(words, name=missing[0])
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
