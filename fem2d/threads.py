"""The threads of a computation, and how they share the interpreter."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from threading import Lock
from typing import ParamSpec, TypeVar

from geometry2d.foundation.errors import DrinksimError

P = ParamSpec("P")
Result = TypeVar("Result")

SWITCH_S = 5e-4
"""Time, s, for which a thread may keep the interpreter from another. Python's default is ten times
as long. The solver, back from a factorisation, would wait for so long while the last increment is
reported: a tenth of the time of a replay."""


class ThreadsError(DrinksimError):
    """A number of threads is not supported."""


class Threads:
    """One or two threads; results are the same to the last bit for both.

    Kernels and factorisations release the interpreter's lock, so that two of them run at once. A
    task may hand tasks to the threads it runs on: these then run one after another in its place.

    Parameters
    ----------
    count
        1: everything runs on the caller's thread. 2: half of the work runs on a second one.
    """

    def __init__(self, count: int = 2) -> None:
        if count not in {1, 2}:
            raise ThreadsError(f"count = {count}: mechanics computes on 1 or 2 threads")
        self.count = count
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="second")
        self._free = Lock()

    def __repr__(self) -> str:
        return f"Threads({self.count})"

    def run(self, tasks: Sequence[Callable[[], Result]]) -> list[Result]:
        """Return the results of tasks: the first runs here, the others on the second thread."""
        if len(tasks) < 2 or self.count == 1 or not self._free.acquire(blocking=False):
            return [task() for task in tasks]
        try:
            first, *others = tasks
            waiting = [self._pool.submit(task) for task in others]
            try:
                results = [first()]
            finally:
                wait(waiting)
            return results + [other.result() for other in waiting]
        finally:
            self._free.release()

    def aside(self) -> Executor:
        """Return an executor that runs tasks in order in the background; at once on one thread."""
        return ThreadPoolExecutor(1, "aside") if self.count > 1 else _AtOnce()

    @contextmanager
    def tuned(self) -> Iterator[None]:
        """Let threads hand over the interpreter quickly for as long as the context lasts."""
        before = sys.getswitchinterval()
        sys.setswitchinterval(min(before, SWITCH_S))
        try:
            yield
        finally:
            sys.setswitchinterval(before)


class _AtOnce(Executor):
    """Does a task when it is submitted."""

    def submit(
        self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs
    ) -> Future[Result]:
        future: Future[Result] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except BaseException as error:
            future.set_exception(error)
        return future


ONE_THREAD = Threads(1)
"""Everything on the caller's thread."""
