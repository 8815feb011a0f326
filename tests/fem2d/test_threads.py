"""One or two threads: the same results, nested tasks, errors."""

from __future__ import annotations

import subprocess
import sys
import threading
from functools import partial

import pytest

from fem2d.threads import Threads, ThreadsError


def where() -> str:
    return threading.current_thread().name


def test_two_threads_share_and_one_does_not():
    here = where()
    assert Threads(1).run([where, where]) == [here, here]
    first, second, third = Threads(2).run([where, where, where])
    assert first == here
    assert second == third != here


def test_a_task_may_hand_tasks_to_the_threads_that_it_runs_on():
    threads = Threads(2)
    inner = partial(threads.run, [where, where])
    (a, b), (c, d) = threads.run([inner, inner])
    assert a == b == where()
    assert c == d != where()


@pytest.mark.parametrize("failing", [0, 1])
def test_an_error_in_either_task_is_raised_and_leaves_the_threads_free(failing):
    threads = Threads(2)

    def fail() -> str:
        raise OSError("broken")

    tasks = [where, where]
    tasks[failing] = fail
    with pytest.raises(OSError, match="broken"):
        threads.run(tasks)
    assert threads.run([where, where])[1] != where()


def test_counts_that_make_no_sense_are_refused():
    with pytest.raises(ThreadsError, match="count = 3"):
        Threads(3)


def test_importing_mechanics_changes_nothing_of_the_process():
    code = (
        "import os, sys, threading\n"
        "before = (sys.getswitchinterval(), dict(os.environ), threading.active_count())\n"
        "import fem2d.solvers.march, fem2d.solvers.static, fem2d.export.deck\n"
        "assert before == (sys.getswitchinterval(), dict(os.environ), threading.active_count())\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
