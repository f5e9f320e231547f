"""Where compiled kernels are kept between runs: compiling them takes some twenty seconds, reading them back one."""

import os
import sys
from pathlib import Path

import jax


def use_compilation_cache() -> None:
    """Let JAX keep what it compiles in `cache_folder()`; where that cannot be written, do without."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if not os.access(folder, os.W_OK):
        return
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)


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
