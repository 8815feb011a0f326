"""Writing a run directory so that a killed run loses nothing it had computed.

While a run goes on, every committed increment is one file of ``increments/`` in the ``.partial``
directory, put there by a rename: however the run ends, each increment is complete or absent. The
checkpoints of the last two are kept: the run goes on from the last increment that can be read. Only
a complete run gets ``fields.h5`` and its final name. Finishing can be killed anywhere: a run counts
as complete once ``summary.json`` is there, and the next writer tidies up what is left to do.
"""

from __future__ import annotations

import csv
import json
import shutil
import time
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import h5py
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.output import (
    claimed,
    copy_directory,
    empty_directory,
    file_at_once,
    put_in_place,
    remove_directory,
)
from geometry2d.rigid import RigidPlacement
from scenarios.results.fields_file import FIELDS_FILE, FieldRows, write_model
from scenarios.results.history_file import HISTORY_FILE, as_written, write_history
from scenarios.results.increment import ContactField, Increment, SectionModel, SolutionError
from scenarios.results.integrity import (
    CONVERTED,
    checksum,
    differing_input,
    fingerprint,
    read_inputs,
    sealed,
    write_inputs,
)
from scenarios.results.summary import SUMMARY_FILE, run_summary
from scenarios.settings.files import SCENARIO_FILE

Arrays = dict[str, NDArray[Any]]


class SolutionWriter:
    """Writes a run directory, increment by increment, so that a killed run loses nothing.

    Parameters
    ----------
    out
        the directory to appear when the run is complete; until then it is called ``out.partial``.
    scenario_toml
        the resolved scenario.
    inputs
        checksums, by name, of what the run depends on beside its settings.
    sources
        files that are copied into the run directory.
    resume
        go on after the last increment in ``out.partial`` if there is one.
    overwrite
        discard what an earlier run left in ``out.partial``.

    Raises
    ------
    SolutionError
        If there are increments and neither ``resume`` nor ``overwrite`` is set, if they were
        computed from other inputs, or if they are damaged.
    """

    def __init__(
        self,
        out: Path,
        scenario_toml: str,
        *,
        inputs: Mapping[str, str] | None = None,
        sources: Collection[Path] = (),
        resume: bool = False,
        overwrite: bool = False,
    ) -> None:
        self.out = out
        self._claim = ExitStack()
        self.partial = self._claim.enter_context(claimed(out))
        self._increments = self.partial / "increments"
        self._started = time.monotonic()
        self._fingerprint = fingerprint(scenario_toml, inputs or {})
        try:
            if overwrite or not self._goes_on(resume=resume):
                self._begin_anew(scenario_toml, sources)
        except BaseException:
            self._claim.close()
            raise
        if not self.is_complete:
            self._increments.mkdir(exist_ok=True)
        self.count = len(self._files())
        self.log(f"drinksim {version('drinksim')}, after {self.count} increments")

    def __enter__(self) -> SolutionWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Leave nothing behind if the run failed before there was anything to go on from."""
        if kind is not None and self.count == 0 and not self.is_complete:
            self.discard()
        self._claim.close()

    @property
    def folder(self) -> Path:
        """The directory that is being filled."""
        return self.partial

    @property
    def is_complete(self) -> bool:
        """Whether a run was killed when nothing but tidying up was left to do; see `tidy`."""
        return (self.partial / SUMMARY_FILE).is_file()

    def _begin_anew(self, scenario_toml: str, sources: Collection[Path]) -> None:
        """Empty the draft, and write what the run depends on."""
        inside = [file for file in sources if self.partial.resolve() in file.resolve().parents]
        if inside:
            raise SolutionError(
                f"{inside[0]} lies in the unfinished run that would be started anew: go on with "
                "it by --resume, or copy its files elsewhere first"
            )
        empty_directory(self.partial)
        with file_at_once(self.partial / SCENARIO_FILE) as partial:
            partial.write_text(scenario_toml, encoding="utf-8")
        write_inputs(self.partial, self._fingerprint)

    def _goes_on(self, *, resume: bool) -> bool:
        """Whether what an earlier run left is used; it is checked then."""
        increments = self._files()
        if increments and not resume and not self.is_complete:
            raise SolutionError(
                f"{self.partial} holds {len(increments)} increments of an unfinished run: --resume "
                "goes on after them, --overwrite starts anew"
            )
        other = differing_input(self.partial, self._fingerprint)
        if other is not None and (increments or self.is_complete):
            raise SolutionError(
                f"{self.partial} was started with {other}: repeat the run with the same, or start "
                "anew with --overwrite"
            )
        if increments and not self.is_complete:
            self._drop_damaged(increments)
        return other is None

    def _drop_damaged(self, files: Sequence[Path]) -> None:
        """Remove a last increment that cannot be read; refuse if others cannot."""
        readable = [_is_readable(file) for file in files]
        last = len(files) - 1
        if not (readable[last] and _is_readable(self._checkpoint_file(last))):
            files[last].unlink()
            self._checkpoint_file(last).unlink(missing_ok=True)
            readable, last = readable[:last], last - 1
        damaged = [number for number, whole in enumerate(readable, start=1) if not whole]
        if damaged or (last >= 0 and not _is_readable(self._checkpoint_file(last))):
            number = damaged[0] if damaged else last + 1
            raise SolutionError(
                f"{self.partial}: increment {number} is damaged, so the run cannot go on: start "
                "anew with --overwrite"
            )
        with (self.partial / HISTORY_FILE).open("w", newline="", encoding="utf-8") as stream:
            write_history(stream, (increment.row() for increment in self.increments()))

    def keep(self, source: Path, place: str) -> Path:
        """Copy a file, or a run directory, to a place in the run directory, and return it there.

        Raises
        ------
        SolutionError
            If another one is there.
        """
        kept = self.partial / place
        if not kept.exists():
            kept.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                copy_directory(source, kept)
            else:
                with file_at_once(kept) as partial:
                    shutil.copyfile(source, partial)
        told = [each / SUMMARY_FILE if source.is_dir() else each for each in (source, kept)]
        if checksum(told[0]) != checksum(told[1]):
            raise SolutionError(
                f"{self.out} was started with another {kept.name} than {source}: give that one, "
                "or start anew with --overwrite"
            )
        return kept

    def converted(self, motion: Path) -> None:
        """Note the motion that the run made of its recording: it goes on with no other one.

        Raises
        ------
        SolutionError
            If the run was started with another one.
        """
        known = read_inputs(self.partial) or self._fingerprint
        if known.setdefault(CONVERTED, checksum(motion)) != checksum(motion):
            raise SolutionError(
                f"{motion} was changed after the run was started: start anew with --overwrite"
            )
        write_inputs(self.partial, known)

    def last(self) -> Increment | None:
        """Return the last complete increment, from which a run can go on, or None."""
        files = self._files()
        if not files:
            return None
        arrays = _read_arrays(self._checkpoint_file(len(files) - 1))
        return replace(_read_increment(files[-1]), checkpoint=arrays)

    def model(self, model: SectionModel) -> None:
        """Write the undeformed section; once, before the first increment."""
        arrays: dict[str, NDArray[Any]] = {
            "nodes": model.nodes,
            "triangles": model.triangles,
            "region": model.region,
            "region_names": np.array(model.region_names),
        }
        arrays |= {f"skin/{lip}": edges for lip, edges in model.skin.items()}
        arrays |= {f"outlines/{name}": line for name, line in model.outlines.items()}
        _write_arrays(self.partial / "model.npz", arrays)

    def commit(self, increment: Increment) -> None:
        """Add a converged increment; when this returns it is safe on disk."""
        row = increment.row()
        # The checkpoint goes first: an increment counts from the moment its own file is there.
        _write_arrays(self._checkpoint_file(self.count), dict(increment.checkpoint))
        _write_arrays(self._increments / f"{self.count:06d}.npz", _increment_arrays(increment))
        self._checkpoint_file(self.count - 2).unlink(missing_ok=True)
        self.count += 1
        history = self.partial / HISTORY_FILE
        new = not history.exists()
        with history.open("a", newline="", encoding="utf-8") as stream:
            if new:
                write_history(stream, [row])
            else:
                csv.writer(stream).writerow(as_written(row))
        self.log(
            f"increment {self.count}: time {increment.time_s:.4f} s, "
            f"{increment.newton_iterations} iterations, {increment.cutbacks} cutbacks"
        )

    def log(self, line: str) -> None:
        """Add a line to run.log."""
        seconds = time.monotonic() - self._started
        with (self.partial / "run.log").open("a", encoding="utf-8") as stream:
            stream.write(f"{seconds:9.2f} s  {line}\n")

    def discard(self) -> None:
        """Remove what has been written."""
        remove_directory(self.partial)
        self._claim.close()

    def increments(self) -> Iterator[Increment]:
        """Yield the increments that are on disk, without checkpoints."""
        return (_read_increment(file) for file in self._files())

    def finish(self, *, finished: bool, message: str, about: Mapping[str, Any]) -> None:
        """Write history.csv, fields.h5 and summary.json, and put the directory in its place.

        ``finished`` says whether the whole motion was replayed, ``message`` how it ended, and
        ``about`` is added to the summary. There must be an increment.
        """
        rows = []
        with file_at_once(self.partial / FIELDS_FILE) as partial, h5py.File(partial, "w") as store:
            write_model(store, _read_model(self.partial / "model.npz"))
            fields = FieldRows(store, self.count)
            for index, increment in enumerate(self.increments()):
                rows.append(increment.row())
                fields.write(index, increment)
        with (
            file_at_once(self.partial / HISTORY_FILE) as partial,
            partial.open("w", newline="", encoding="utf-8") as stream,
        ):
            write_history(stream, rows)
        self.log(message)
        seconds = time.monotonic() - self._started
        summary = run_summary(rows, finished=finished, message=message, wall_s=seconds, about=about)
        text = json.dumps(sealed(summary, self.partial), indent=2, allow_nan=False)
        with file_at_once(self.partial / SUMMARY_FILE) as partial:
            partial.write_text(text + "\n", encoding="utf-8")
        self.tidy()

    def tidy(self) -> None:
        """Remove what only an unfinished run needs, and put the directory in its place."""
        shutil.rmtree(self._increments, ignore_errors=True)
        for file in (*self.partial.glob("checkpoint-*.npz"), self.partial / "model.npz"):
            file.unlink(missing_ok=True)
        put_in_place(self.partial, self.out)
        self._claim.close()

    def _checkpoint_file(self, number: int) -> Path:
        return self.partial / f"checkpoint-{number:06d}.npz"

    def _files(self) -> list[Path]:
        return sorted(self._increments.glob("[0-9]*.npz"))


def _write_arrays(file: Path, arrays: Arrays) -> None:
    with file_at_once(file) as partial:
        np.savez(partial, **arrays)  # type: ignore[arg-type]


def _read_arrays(file: Path) -> Arrays:
    with np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def _is_readable(file: Path) -> bool:
    """Whether every array of a file can be read; each carries a checksum."""
    try:
        _read_arrays(file)
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, zlib.error):
        return False
    return True


def _group(arrays: Arrays, name: str) -> Arrays:
    """Return the arrays whose names start with ``name/``, under the rest of their names."""
    prefix = f"{name}/"
    return {
        key.removeprefix(prefix): value for key, value in arrays.items() if key.startswith(prefix)
    }


def _read_model(file: Path) -> SectionModel:
    arrays = _read_arrays(file)
    return SectionModel(
        nodes=arrays["nodes"],
        triangles=arrays["triangles"],
        region=arrays["region"],
        region_names=tuple(str(name) for name in arrays["region_names"]),
        skin=_group(arrays, "skin"),
        outlines=_group(arrays, "outlines"),
    )


def _increment_arrays(increment: Increment) -> Arrays:
    place = increment.placement
    arrays: Arrays = {
        "time": np.array([increment.time_s, increment.relative_time]),
        "placement": np.array([place.angle_rad, *place.shift_mm]),
        "displacement": increment.displacement,
        "cost": np.array([increment.newton_iterations, increment.cutbacks]),
    }
    arrays |= {f"element/{name}": np.asarray(field) for name, field in increment.element.items()}
    arrays |= {f"history/{name}": np.array(value) for name, value in increment.history.items()}
    for lip, contact in increment.contact.items():
        arrays |= {
            f"contact/{lip}/{f.name}": getattr(contact, f.name) for f in dataclass_fields(contact)
        }
    return arrays


def _read_increment(file: Path) -> Increment:
    arrays = _read_arrays(file)
    angle, x, y = arrays["placement"]
    contact = _group(arrays, "contact")
    lips = sorted({name.split("/")[0] for name in contact})
    return Increment(
        time_s=float(arrays["time"][0]),
        relative_time=float(arrays["time"][1]),
        placement=RigidPlacement(float(angle), (float(x), float(y))),
        displacement=arrays["displacement"],
        element=_group(arrays, "element"),
        contact={lip: ContactField(**_group(contact, lip)) for lip in lips},
        history={name: float(value) for name, value in _group(arrays, "history").items()},
        newton_iterations=int(arrays["cost"][0]),
        cutbacks=int(arrays["cost"][1]),
    )
