"""Reads a C3D file in a separate process: ``python c3d_child.py FILE MEMORY_BYTES CPU_SECONDS``.

The library that reads C3D is not safe on damaged files: it can end its process or use all memory.
Here the caller limits the additional memory and the processor time, where the system supports such
limits. The arrays go to standard output; other values are not sent.
"""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path

import ezc3d
import numpy as np

MOST_LABEL_LISTS = 99
"""Names beyond 255 points are in LABELS2, LABELS3, …"""


def limit(memory_bytes: int, cpu_seconds: int) -> None:
    """Limit the additional memory of this process and its total processor time."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (ImportError, OSError):
        return
    most = pages * os.sysconf("SC_PAGE_SIZE") + memory_bytes
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds))


def arrays(file: str) -> dict[str, np.ndarray]:
    """Return points (4, m, n), residuals (m, n), first frame, rate, names and units of a file."""
    content = ezc3d.c3d(file)
    header, parameters = content["header"]["points"], content["parameters"]["POINT"]
    lists = ("LABELS", *(f"LABELS{k}" for k in range(2, MOST_LABEL_LISTS)))
    names = [str(name) for key in lists if key in parameters for name in parameters[key]["value"]]
    units = [str(unit) for unit in parameters.get("UNITS", {}).get("value", [])]
    return {
        "points": np.asarray(content["data"]["points"], float),
        "residuals": np.asarray(content["data"]["meta_points"]["residuals"], float)[0],
        "first_frame": np.array(int(header["first_frame"])),
        "rate_hz": np.array(float(header["frame_rate"])),
        "names": np.array(names, str),
        "units": np.array(units, str),
    }


def main() -> int:
    """Write the arrays to standard output; return 1 if the library cannot read the file."""
    file, memory_bytes, cpu_seconds = sys.argv[1:]
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of the library goes to standard error
    limit(int(memory_bytes), int(cpu_seconds))
    buffer = io.BytesIO()
    try:
        with np.errstate(all="ignore"):
            np.savez(buffer, allow_pickle=False, **arrays(file))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError, TypeError, MemoryError):
        return 1
    with output:
        output.write(buffer.getbuffer())
    return 0


if __name__ == "__main__":
    sys.exit(main())
