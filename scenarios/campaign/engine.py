"""Where tasks are computed: in this process, in local workers, or by a Dask scheduler.

An engine knows nothing of sips: it calls a function of a task and yields what comes out, in the
order in which tasks end. Whoever computes, results are the same, because a task holds all that its
function depends on.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from scenarios.campaign.variation import StudyError

Task = TypeVar("Task")
Result = TypeVar("Result")

INSTALL = "pip install 'drinksim[study]'"

WORKER = "scenarios.campaign.worker"
"""Module that a local worker imports first."""

CONNECT_S = 20
"""Time in which a scheduler must answer, s."""


@dataclass(frozen=True)
class Ended(Generic[Result]):
    """A task that ended.

    Attributes
    ----------
    index
        Of the task.
    result
        What its function returned; None if it could not.
    reason
        Why not.
    """

    index: int
    result: Result | None
    reason: str = ""


class Engine(Protocol):
    """Computes tasks."""

    @property
    def isolated(self) -> bool:
        """Whether a worker is a process that may be ended without loss of another task."""

    @property
    def workers(self) -> int:
        """How many tasks are computed at once."""

    def ended(
        self, function: Callable[[Task], Result], tasks: Sequence[Task], *, retries: int = 0
    ) -> Iterator[Ended[Result]]:
        """Yield what comes out of a function for each task, as they end.

        Parameters
        ----------
        function
            Of one task; it stands in a module, so that a worker can import it.
        tasks
            The tasks.
        retries
            How often a task is computed again whose worker was lost, or whose function raised.
        """


@dataclass(frozen=True)
class InProcess:
    """Computes one task after the other here."""

    isolated: bool = False
    workers: int = 1

    def ended(
        self, function: Callable[[Task], Result], tasks: Sequence[Task], *, retries: int = 0
    ) -> Iterator[Ended[Result]]:
        """Yield what comes out, in the order of the tasks."""
        for index, task in enumerate(tasks):
            yield _tried(function, task, index, retries)


def _tried(
    function: Callable[[Task], Result], task: Task, index: int, retries: int
) -> Ended[Result]:
    for attempt in range(retries + 1):
        try:
            return Ended(index, function(task))
        except Exception as error:
            if attempt == retries:
                return Ended(index, None, _told(error))
    raise AssertionError("unreachable")


class DaskEngine:
    """Computes tasks by the workers of a Dask scheduler.

    Parameters
    ----------
    client
        Connected to the scheduler.
    """

    isolated = True

    def __init__(self, client: Any) -> None:
        self._client = client

    @property
    def workers(self) -> int:
        """How many threads the scheduler's workers have together, at least one."""
        return max(sum(map(int, self._client.nthreads().values())), 1)

    def ended(
        self, function: Callable[[Task], Result], tasks: Sequence[Task], *, retries: int = 0
    ) -> Iterator[Ended[Result]]:
        """Yield what comes out, in the order in which tasks end.

        No more tasks are handed over than there are workers: a worker that dies takes one along.
        """
        running = _distributed().as_completed()
        of_future: dict[Any, int] = {}
        waiting, tries = deque(range(len(tasks))), dict.fromkeys(range(len(tasks)), 0)

        def fill() -> None:
            while waiting and len(of_future) < self.workers:
                index = waiting.popleft()
                future = self._client.submit(function, tasks[index], pure=False)
                of_future[future] = index
                running.add(future)

        try:
            fill()
            while of_future:
                future = next(running)
                index, error = of_future.pop(future), future.exception()
                if error is None:
                    outcome = Ended(index, future.result())
                elif tries[index] < retries:
                    tries[index] += 1
                    waiting.append(index)
                    outcome = None
                else:
                    outcome = Ended(index, None, _told(error))
                future.release()
                fill()
                if outcome is not None:
                    yield outcome
        finally:
            self._client.cancel(list(of_future))


def _told(error: BaseException) -> str:
    name = type(error).__name__
    if name == "KilledWorker":
        return "lost its worker, again and again: out of memory, killed, or crashed"
    return f"{name}: {' '.join(str(error).split())}"


@contextmanager
def opened_engine(
    *, workers: int | None = None, scheduler: str | None = None, memory_mb: float | None = None
) -> Iterator[Engine]:
    """Yield an engine, closed afterwards.

    Parameters
    ----------
    workers
        That many processes of one thread each on this machine; None or 0: this process.
    scheduler
        Address of a Dask scheduler whose workers see the same files; beside it no ``workers``.
    memory_mb
        At which a local worker is replaced.

    Raises
    ------
    StudyError
        If Dask is not installed, or no scheduler answers.
    """
    if scheduler is None and not workers:
        yield InProcess()
        return
    if scheduler is not None and workers is not None:
        raise StudyError("--workers and --scheduler contradict one another: give one of them")
    distributed = _distributed()
    if scheduler is not None:
        with _connected(distributed, scheduler) as client:
            yield DaskEngine(client)
        return
    assert workers is not None
    cluster = distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        memory_limit="auto" if memory_mb is None else int(memory_mb * 1e6),
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
        preload=[WORKER],
    )
    with cluster, distributed.Client(cluster) as client:
        yield DaskEngine(client)


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    try:
        client = distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError) as error:
        raise StudyError(
            f"--scheduler {address}: no scheduler answers within {CONNECT_S} s ({error}): start "
            "one with dask scheduler, or check the address"
        ) from None
    with client:
        yield client


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise StudyError(f"dask is not installed, which workers need: {INSTALL}") from None
    # A task whose worker dies is tried again by the engine, which counts.
    import dask

    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    return distributed
