"""A film that is being marked: what was said so far, the tracks that follow from it, undo, saving.

States are values; a session only remembers which one holds, which came before, and what was saved.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from geometry2d.foundation.output import RESULT_MARK, check_replaceable, directory_at_once
from geometry2d.foundation.progress import Progress
from mocap.convert import convert
from scenarios.marking.document import contacts_text, marker_file_text, scenario_text
from scenarios.marking.film import Film
from scenarios.marking.pointing import MarkingError
from scenarios.marking.state import MarkingState
from scenarios.settings.files import SCENARIO_FILE

MARKERS, TRACKS, CONTACTS = "markers.toml", "tracks.csv", "contacts.csv"
MOTION = "motion"


@dataclass(frozen=True)
class Converted:
    """A motion that was computed from a state."""

    motion: Path
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Work:
    """What is being done, and which share of it is done."""

    text: str
    share: float


Change = Callable[[MarkingState, Film, Progress], MarkingState]


@dataclass(eq=False)
class Session:
    """A film that is being marked by one person.

    Parameters
    ----------
    film
        The film.
    out
        The directory that is written, and no other place.
    state
        What is known at the start.
    """

    film: Film
    out: Path
    state: MarkingState
    past: list[MarkingState] = field(default_factory=list)
    future: list[MarkingState] = field(default_factory=list)
    saved: MarkingState | None = None
    converted: Converted | None = None
    work: Work | None = None
    _busy: threading.Lock = field(default_factory=threading.Lock)

    def change(self, change: Change) -> None:
        """Replace the state by what a change makes of it.

        Raises
        ------
        DrinksimError
            If the change cannot be made, or another one is being made; the state stays.
        """
        with self._working() as progress:
            new = change(self.state, self.film, progress)
            if new is not self.state:
                self.past.append(self.state)
                self.future.clear()
                self.state, self.converted = new, None

    def undo(self) -> None:
        """Return to the state before the last change."""
        self._step(self.past, self.future)

    def redo(self) -> None:
        """Make the change again that was undone last."""
        self._step(self.future, self.past)

    def save(self) -> None:
        """Write marker file, tracks and scenario; what was converted from another state is removed.

        Raises
        ------
        OutputError
            If the directory holds anything but results, or cannot be written.
        """
        if self.saved is self.state:
            return
        marking = self.state.marking
        with directory_at_once(self.out) as folder:
            text = marker_file_text(marking.marker_file(self.out / MARKERS))
            (folder / MARKERS).write_text(text, encoding="utf-8")
            if self.state.tracks is not None:
                self.state.table().write(folder / TRACKS)
            time_of = self.film.time_of()
            if marking.touches:
                contacts = contacts_text(marking, time_of)
                (folder / CONTACTS).write_text(contacts, encoding="utf-8")
            scenario = scenario_text(
                marking,
                time_of,
                name=self.film.path.stem,
                video=self.film.path,
            )
            (folder / SCENARIO_FILE).write_text(scenario, encoding="utf-8")
        self.saved = self.state

    def convert(self) -> None:
        """Save, and convert the film into a motion beside what was saved.

        Raises
        ------
        DrinksimError
            If the film is not tracked, or its tracks give no motion.
        """
        if self.state.tracks is None:
            raise MarkingError("the film is not tracked yet: place the markers and track them")
        with self._working() as progress:
            self.save()
            place = self.out / MOTION
            result = convert(
                self.film.path,
                self.out / MARKERS,
                tracks=self.out / TRACKS,
                out=place,
                start_s=self.film.start_s,
                end_s=self.film.end_s,
                fps=self.film.fps,
                progress=progress,
            )
            self.converted = Converted(place / "motion.csv", result.warnings)

    def _step(self, source: list[MarkingState], target: list[MarkingState]) -> None:
        with self._working():
            if not source:
                raise MarkingError("there is nothing more to undo or redo")
            target.append(self.state)
            self.state, self.converted = source.pop(), None

    @contextmanager
    def _working(self) -> Iterator[Progress]:
        if not self._busy.acquire(blocking=False):
            raise MarkingError("the last step is still being done: wait for it")

        def progress(share: float, text: str) -> None:
            self.work = Work(text, share)

        try:
            self.work = Work("", 0.0)
            yield progress
        finally:
            self.work = None
            self._busy.release()


def refuse_place(out: Path) -> None:
    """Raise :class:`OutputError` if a directory cannot be written, or holds other files."""
    check_replaceable(out)
    if (out / RESULT_MARK).exists():
        raise MarkingError(f"--out {out} holds another result: give another directory")
