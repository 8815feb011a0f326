"""The one place where kernels are handed to the compiler."""

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
    """Compile a kernel once and keep it on disk; results do not depend on the number of threads.

    Division follows numpy (no exception on zero), and no reordering of floating-point operations
    is allowed, so that the same input gives the same bits. Kernels release the
    interpreter's lock, so that two of them can run side by side.
    """
    dispatcher: Any = numba.njit(cache=True, fastmath=False, error_model="numpy", nogil=True)(
        function
    )
    if dispatcher is function:  # NUMBA_DISABLE_JIT, for a debugger
        return function
    # Numba recompiles a kernel when its own file changes, but not when a kernel it calls in
    # another file does: tie what is on disk to all files with kernels.
    stored = dispatcher._cache._cache_file
    stored._source_stamp = (stored._source_stamp, _kernel_stamp())
    return cast(Function, dispatcher)


@lru_cache(maxsize=1)
def _kernel_stamp() -> str:
    """Return a fingerprint of all files that hold kernels."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    files = [path for package in PACKAGES for path in (root / package).rglob("*.py")]
    for path in sorted(files):
        source = path.read_bytes()
        if b"@compiled" in source:
            digest.update(source)
    return digest.hexdigest()
