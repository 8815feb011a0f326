"""The one place where kernels are handed to the compiler."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a kernel once and keep it on disk; results do not depend on the number of threads.

    Division follows numpy (no exception on zero), and no reordering of floating-point operations
    is allowed, so that the same input gives the same bits.
    """
    return cast(Function, numba.njit(cache=True, fastmath=False, error_model="numpy")(function))
