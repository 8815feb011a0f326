"""The one thread that takes half of the solver's work: half of the elements, or a whole part."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache


@cache
def second_thread() -> ThreadPoolExecutor:
    """Return the thread; what runs on it must not hand anything to it."""
    return ThreadPoolExecutor(max_workers=1, thread_name_prefix="second")
