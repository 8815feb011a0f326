"""Compilation of kernels."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

PACKAGES = ("geometry2d", "mocap", "fem2d")
"""Where kernels are."""

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Return a kernel that is compiled once and cached on disk.

    Division follows numpy: zero raises no exception. Floating-point operations are not reordered:
    the same input gives the same bits, with any number of threads. Kernels release the
    interpreter's lock, so that several can run at a time.
    """
    dispatcher: Any = numba.njit(cache=True, fastmath=False, error_model="numpy", nogil=True)(
        function
    )
    if dispatcher is function:  # NUMBA_DISABLE_JIT, for a debugger
        return function
    # Numba recompiles a kernel if its own file changes, but not if a kernel that it calls in
    # another file does: the cache depends on all files with kernels.
    stored = dispatcher._cache._cache_file
    stored._source_stamp = (stored._source_stamp, _kernel_stamp())
    return cast(Function, dispatcher)


@lru_cache(maxsize=1)
def _kernel_stamp() -> str:
    """Return a hash of all files with kernels."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    files = [path for package in PACKAGES for path in (root / package).rglob("*.py")]
    for path in sorted(files):
        source = path.read_bytes()
        if b"@compiled" in source:
            digest.update(source)
    return digest.hexdigest()
