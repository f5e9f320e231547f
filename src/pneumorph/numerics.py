"""Settings of the process that the numerical packages need, made when the first of them is imported.

``import pneumorph`` alone changes nothing. The first use of mechanics or limits

- sets the environment variables KMP_BLOCKTIME and OMP_WAIT_POLICY, where they are not set: threads of the linear solver
  that spin while they wait take the cores from the kernels in between, measured twice as slow;
- switches jax to double precision: equilibria are solved to nine digits and gradients checked to eight;
- lets jax keep compiled kernels in `cache_folder()`, where it has no such folder yet: compiling takes some ten
  seconds, reading them back one.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("KMP_BLOCKTIME", "0")
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import jax


def cache_folder() -> Path:
    """PNEUMORPH_CACHE, or pneumorph's folder where the platform keeps caches."""
    if chosen := os.environ.get("PNEUMORPH_CACHE"):
        return Path(chosen)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA", "~/AppData/Local")
    elif sys.platform == "darwin":
        base = "~/Library/Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "pneumorph"


def _keep_compiled(folder: Path) -> None:
    """Let jax keep what it compiles in a folder; where that cannot be written, do without."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if os.access(folder, os.W_OK):
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


jax.config.update("jax_enable_x64", True)
if not getattr(jax.config, "jax_compilation_cache_dir", None):
    _keep_compiled(cache_folder())
