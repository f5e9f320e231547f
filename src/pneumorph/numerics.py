"""Process-wide settings that the numerical packages need, made when the first of them is imported.

``import pneumorph`` alone changes nothing. The first use of the mechanics or the limits

- sets the environment variables KMP_BLOCKTIME and OMP_WAIT_POLICY unless they are set already: threads of the linear
  solver that spin while waiting occupy the cores and make the kernels that run in between twice as slow (measured);
- switches jax to double precision, because equilibria are solved to nine digits and gradients are checked to eight;
- lets jax run kernels in the thread that calls them: their answers are waited for at once, and handing a small one to
  another thread took three times as long as running it;
- lets jax cache compiled kernels in `cache_folder()`, unless it has a cache folder already: compiling takes about
  ten seconds, reading the kernels back one;
- adds `QUICK` to the environment variable XLA_FLAGS, unless that says something about it already.
"""

import contextlib
import os
from pathlib import Path

os.environ.setdefault("KMP_BLOCKTIME", "0")
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import jax
import platformdirs

from pneumorph import compiling

QUICK = "--xla_cpu_use_fusion_emitters=false"
"""The emitters of kernels that XLA had before its newer ones: the kernels of sheets compile in 60 % of the time with
them (measured), and run about as fast. XLA ends a process whose flags it does not know, so only the versions of jax
that this was tried with get it."""

TRIED = ((0, 10),)
"""Versions of jax that know `QUICK`."""


def flags(given: str, version: tuple[int, ...]) -> str:
    """XLA_FLAGS for a version of jax, from those that are there."""
    wanted = version[:2] in TRIED and QUICK.split("=")[0] not in given
    return f"{given} {QUICK}".strip() if wanted else given


def cache_folder() -> Path:
    """The folder named by PNEUMORPH_CACHE, or else pneumorph's folder in the platform's cache directory."""
    if chosen := os.environ.get("PNEUMORPH_CACHE"):
        return Path(chosen)
    return platformdirs.user_cache_path("pneumorph", appauthor=False, opinion=False)


def _keep_compiled(folder: Path) -> None:
    """Let jax cache what it compiles in a folder; do nothing if the folder is not writable."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if os.access(folder, os.W_OK):
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def tells_of_kernels(warning: str) -> bool:
    """Whether a warning is jax's about a kernel in its cache; where one cannot be read, all in our folder are removed.

    jax never replaces a kernel: one that was written in part would be compiled in every process from then on.
    """
    if "persistent compilation cache entry" not in warning:
        return False
    folder = cache_folder()
    if warning.startswith("Error reading") and getattr(jax.config, "jax_compilation_cache_dir", None) == str(folder):
        for path in folder.glob("*-cache"):
            with contextlib.suppress(OSError):
                path.unlink()
    return True


# XLA reads them when it compiles for the first time.
os.environ["XLA_FLAGS"] = flags(os.environ.get("XLA_FLAGS", ""), jax.__version_info__)
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_cpu_enable_async_dispatch", False)
if not getattr(jax.config, "jax_compilation_cache_dir", None):
    _keep_compiled(cache_folder())
compiling.watch()
