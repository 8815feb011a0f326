"""The page of a session on this machine: a thin shell that answers requests of one person.

Every address begins with a token that is drawn anew each time, so that no other program or page of
the machine can guess one. The name by which the page was called must be this machine's own, which
keeps out pages that make their name point here. Nothing is loaded from elsewhere. Files that are
read are those of this package and the film; written is what the session writes.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Awaitable, Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Receive, Scope, Send

from geometry2d.foundation.errors import DrinksimError
from scenarios.marking.events import change_for
from scenarios.marking.session import Session
from scenarios.marking.view import page_spots, page_state, progress_state

HOST = "127.0.0.1"
TOKEN_BYTES = 24
MOST_BODY_BYTES = 10_000

HEADERS = (
    (
        b"content-security-policy",
        b"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        b"connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (b"cache-control", b"no-store"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"cross-origin-resource-policy", b"same-origin"),
)


class Guard:
    """Answers only requests that name this machine and know the token.

    Parameters
    ----------
    app
        What answers them.
    token
        First part of every address.
    port
        The port on which the page is served.
    """

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app = app
        self._token = token.encode("ascii")
        self._hosts = {f"{name}:{port}".encode("ascii") for name in (HOST, "localhost")}
        self._origins = {b"http://" + host for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        fault = self._fault(scope)
        if fault:
            await PlainTextResponse(fault, status_code=403)(scope, receive, send)
            return

        async def send_guarded(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *HEADERS]
            await send(message)

        await self._app(scope, receive, send_guarded)

    def _fault(self, scope: Scope) -> str:
        """Return why a request is refused; empty if it is not."""
        if scope["type"] != "http":
            return "only pages are served"
        headers = dict(scope["headers"])
        if headers.get(b"host") not in self._hosts:
            return "this page is served to this machine only"
        if scope["method"] not in ("GET", "HEAD") and (
            headers.get(b"origin", next(iter(self._origins))) not in self._origins
            or headers.get(b"content-type", b"").split(b";")[0] != b"application/json"
        ):
            return "only the page itself may ask for this"
        given = scope["path"].split("/")[1].encode("utf-8", errors="replace")
        if not secrets.compare_digest(given, self._token):
            return "the address lacks the token that was printed"
        return ""


def application(session: Session, token: str, port: int, finish: Callable[[], None]) -> ASGIApp:
    """Return the application of a session.

    Parameters
    ----------
    session
        The session.
    token, port
        First part of every address, and the port on which it is served.
    finish
        Called when the page is done with.
    """
    shell = _Shell(session, finish)
    page = Path(str(files("scenarios.marking") / "page"))
    inside = [
        Route("/", shell.page),
        Route("/state", shell.state),
        Route("/progress", shell.progress),
        Route("/picture/{row:int}", shell.picture),
        Route("/spots/{frame:int}", shell.spots),
        Route("/do", shell.do, methods=["POST"]),
        Mount("/scripts", StaticFiles(directory=page / "scripts")),
        Mount("/styles", StaticFiles(directory=page / "styles")),
    ]
    return Guard(Starlette(routes=[Mount(f"/{token}", routes=inside)]), token, port)


def new_token() -> str:
    """Return a token that nobody guesses."""
    return secrets.token_urlsafe(TOKEN_BYTES)


class _Shell:
    """Answers of a session to requests."""

    def __init__(self, session: Session, finish: Callable[[], None]) -> None:
        self._session = session
        self._finish = finish
        self._special: dict[str, Callable[[], None]] = {
            "undo": session.undo,
            "redo": session.redo,
            "save": session.save,
            "convert": session.convert,
            "finish": finish,
        }

    async def page(self, request: Request) -> Response:
        text = (files("scenarios.marking") / "page" / "index.html").read_text(encoding="utf-8")
        return HTMLResponse(text)

    async def state(self, request: Request) -> Response:
        return await _answer(lambda: page_state(self._session))

    async def progress(self, request: Request) -> Response:
        return JSONResponse(progress_state(self._session))

    async def picture(self, request: Request) -> Response:
        data = self._session.film.picture(request.path_params["row"])
        if data is None:
            return PlainTextResponse("no such frame", status_code=404)
        return Response(data, media_type="image/jpeg")

    async def spots(self, request: Request) -> Response:
        frame, session = request.path_params["frame"], self._session
        polarity = session.state.marking.polarity
        return await _answer(lambda: page_spots(session.film, frame, polarity))

    async def do(self, request: Request) -> Response:
        """Do what an event asks for, and return the new state."""
        event = await _event(request)
        if event is None:
            return JSONResponse({"error": "the request is no event"}, status_code=400)

        def done() -> Any:
            special = self._special.get(str(event.get("do")))
            if special is not None:
                special()
            else:
                self._session.change(change_for(event))
            return page_state(self._session)

        return await _answer(done)


async def _event(request: Request) -> dict[str, Any] | None:
    """Return the event in a request; None if there is none."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > MOST_BODY_BYTES:
            return None
    try:
        event = json.loads(body)
    except (ValueError, RecursionError):
        return None
    return event if isinstance(event, dict) else None


def _answer(make: Callable[[], Any]) -> Awaitable[Response]:
    """Return what is made in another thread as JSON, or its error in words."""

    async def answered() -> Response:
        try:
            return JSONResponse(await run_in_threadpool(make))
        except DrinksimError as error:
            return JSONResponse({"error": str(error)}, status_code=400)
        except OSError as error:
            reason = f"{error.filename or ''}: {error.strerror or error}".lstrip(": ")
            return JSONResponse({"error": reason}, status_code=400)

    return answered()
