"""The imprint of a run as a table: pressure along the neck's contour, at every increment."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import check_writable, file_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.results.solution import Solution
from scenarios.views.plots import imprint

COLUMNS = ("lip", "time_s", "relative_time", "contour_mm", "stretch", "pressure_kpa")
ENDINGS = (".csv", ".parquet")

ImprintRow = tuple[str, float, float, float, str, float]


class ImprintError(DrinksimError):
    """An imprint cannot be written there."""


def export_imprint(run: Path, out: Path, *, progress: Progress = no_progress) -> None:
    """Write the imprint of a run directory, a row for each place and increment that are pressed.

    Columns are :data:`COLUMNS`: the lip; the increment's time, s, and relative time; the place
    along the outline of the wall, mm; what is there (rim, land, crest 1, …); and the contact
    pressure, kPa.

    Parameters
    ----------
    run
        a run directory.
    out
        a file that ends in ``.csv`` or ``.parquet``; the latter needs pyarrow.

    Raises
    ------
    DrinksimError
        If ``run`` is not a run directory, or ``out`` has another ending or cannot be written.
    """
    if out.suffix.lower() not in ENDINGS:
        raise ImprintError(f"--out {out} must end in {' or '.join(ENDINGS)}")
    check_writable(out)
    rows = list(imprint_rows(Solution.load(run)))
    progress(0.5, f"{len(rows)} rows")
    with file_at_once(out) as partial:
        if out.suffix.lower() == ".csv":
            with partial.open("w", newline="", encoding="utf-8") as stream:
                writer = csv.writer(stream, lineterminator="\n")
                writer.writerow(COLUMNS)
                writer.writerows(rows)
        else:
            _write_parquet(rows, partial)


def _write_parquet(rows: Sequence[ImprintRow], out: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise ImprintError(
            f"--out {out.name}: pyarrow is not installed: pip install 'drinksim[study]', or end "
            "in .csv"
        ) from error
    columns = zip(*rows, strict=True) if rows else ((),) * len(COLUMNS)
    table = pyarrow.table(dict(zip(COLUMNS, map(list, columns), strict=True)))
    parquet.write_table(table, out)


def imprint_rows(solution: Solution) -> Iterator[ImprintRow]:
    """Yield the rows of :func:`export_imprint`."""
    neck = solution.scenario.package.section()
    relative = solution["relative_time"].values
    for lip in solution.contact:
        contour, pressure = imprint(solution, lip)
        names = [_stretch(getattr(neck, f"{lip}_stretches"), float(place)) for place in contour]
        for index, at in zip(*pressure.nonzero(), strict=True):
            yield (
                lip,
                float(solution.time_s[index]),
                float(relative[index]),
                round(float(contour[at]), 3),
                names[at],
                float(f"{pressure[index, at]:.6g}"),
            )


def _stretch(stretches: Mapping[str, tuple[float, float]], place: float) -> str:
    names = (name for name, (start, end) in stretches.items() if start <= place <= end)
    return next(names, "bore").replace("_", " ")
