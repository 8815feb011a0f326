"""What a local worker of Dask does first.

A terminal interrupts all processes of a command. The one that was typed ends its workers itself; a
worker that ended too would only add its complaint.
"""

from __future__ import annotations

import signal


def dask_setup(worker: object) -> None:
    """Leave an interruption to the process that started the worker; Dask calls this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
