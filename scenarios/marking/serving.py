"""A session from its first to its last request: which files it starts from, where it is served."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

from geometry2d.foundation.progress import Progress
from mocap.tracking.marker_file import read_markers
from mocap.tracking.tracks import Tracks, read_tracks
from scenarios.marking.document import with_contacts
from scenarios.marking.events import with_spots
from scenarios.marking.film import Film
from scenarios.marking.marking import Marking, plain_markers
from scenarios.marking.pointing import MarkingError, PlacedPoint
from scenarios.marking.session import CONTACTS, MARKERS, TRACKS, Session, refuse_place
from scenarios.marking.state import opened_state

INSTALL = "pip install 'drinksim[mark]'"


@dataclass(frozen=True)
class Asked:
    """What a session starts from.

    Attributes
    ----------
    video, markers
        The film, and a marker file to start from, if there is one.
    out
        The directory that is written. What was marked there before is gone on with.
    fps, start_s, end_s
        As in :class:`mocap.convert.ConvertOptions`.
    """

    video: Path
    out: Path
    markers: Path | None = None
    fps: float | None = None
    start_s: float | None = None
    end_s: float | None = None


def opened_session(asked: Asked, progress: Progress) -> Session:
    """Return a session whose film is read.

    Raises
    ------
    DrinksimError
        If the film or a file cannot be used, or the directory holds anything but a marking.
    """
    refuse_place(asked.out)
    earlier = asked.markers is None and (asked.out / MARKERS).is_file()
    source = asked.out / MARKERS if earlier else asked.markers
    given = plain_markers() if source is None else read_markers(source)
    film = Film(asked.video, asked.fps, asked.start_s, asked.end_s)
    film.read(progress)
    marking = with_spots(film, Marking.of(given, film.frames[0]))
    tracks = None
    if earlier and (asked.out / TRACKS).is_file():
        tracks = read_tracks(asked.out / TRACKS)
        marking = _with_corrections(marking, tracks, film)
    if earlier and (asked.out / CONTACTS).is_file():
        marking = with_contacts(marking, asked.out / CONTACTS)
    return Session(film, asked.out, opened_state(film, marking, tracks))


def _with_corrections(marking: Marking, tracks: Tracks, film: Film) -> Marking:
    """Return the marking with the positions that tracks say were set by hand.

    Raises
    ------
    MarkingError
        If the tracks are those of another film or interval.
    """
    if tracks.frame.tolist() != film.frames:
        raise MarkingError(
            f"{TRACKS} of --out has frames {tracks.frame[0]} to {tracks.frame[-1]}, and the film "
            f"{film.frames[0]} to {film.frames[-1]}: it is another film or interval; give another "
            "--out"
        )
    for k, name in enumerate(tracks.names):
        for row in (tracks.status[:, k] == "fixed").nonzero()[0]:
            frame = int(tracks.frame[row])
            x, y = (float(value) for value in tracks.position_px[row, k])
            placed = PlacedPoint((x, y), float(tracks.sigma_px[row, k]))
            marking = marking.with_marker(name, frame, placed)
    return marking


def serve(session: Session, *, browser: bool, tell: Callable[[str], None]) -> None:
    """Serve the page of a session until it is done with, or interrupted.

    Parameters
    ----------
    session
        The session.
    browser
        Whether to open the page in the user's browser.
    tell
        Called with the page's address when it can be opened.

    Raises
    ------
    MarkingError
        If the libraries of the extra are missing.
    """
    try:
        import uvicorn

        from scenarios.marking.server import HOST, application, new_token
    except ModuleNotFoundError as error:
        raise MarkingError(f"{error.name} is not installed: {INSTALL}") from None
    token = new_token()
    config = uvicorn.Config(
        "", host=HOST, port=0, log_level="error", access_log=False, lifespan="off", ws="none"
    )
    listener = config.bind_socket()
    port = listener.getsockname()[1]
    address = f"http://{HOST}:{port}/{token}/"

    class Announced(uvicorn.Server):
        async def startup(self, sockets: list[Any] | None = None) -> None:
            await super().startup(sockets)
            tell(address)
            if browser:
                # A browser in the terminal keeps its caller waiting until it is left.
                Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    server = Announced(config)

    def finish() -> None:
        server.should_exit = True

    config.app = application(session, token, port, finish)
    try:
        server.run(sockets=[listener])
    finally:
        listener.close()
