"""Whoever does not know the token, or calls the page by another name, gets nothing."""

from __future__ import annotations

import http.client
import json
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from scenarios.marking.serving import Asked, opened_session, serve
from scenarios.marking.session import Session
from tests.support.clips import Clip
from tests.support.optional import needed_module

needed_module("starlette")
needed_module("uvicorn")

CLIP = Clip(width=320, height=200, px_per_mm=1.0, frames=3, jaw=False)
PAGE = Path(__file__).resolve().parents[3] / "scenarios" / "marking" / "page"


@dataclass
class Server:
    """A session that is served: port, first part of every address."""

    session: Session
    port: int
    path: str

    def ask(
        self, path: str, *, method: str = "GET", body: str = "", **headers: str
    ) -> tuple[int, bytes]:
        link = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        link.putrequest(method, path, skip_host=True)
        sent = {"Host": f"127.0.0.1:{self.port}"} | {
            k.replace("_", "-"): v for k, v in headers.items()
        }
        for name, value in sent.items():
            link.putheader(name, value)
        link.putheader("Content-Length", str(len(body)))
        link.endheaders(body.encode())
        answer = link.getresponse()
        self.headers = {name.lower(): value for name, value in answer.getheaders()}
        found = answer.status, answer.read()
        link.close()
        return found

    def do(self, event: object, **headers: str) -> tuple[int, bytes]:
        sent = {"Content_Type": "application/json"} | headers
        return self.ask(f"{self.path}do", method="POST", body=json.dumps(event), **sent)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("served")
    video, _, _ = CLIP.write(folder)
    session = opened_session(Asked(video, folder / "out"), lambda share, text: None)
    told: list[str] = []
    thread = threading.Thread(
        target=serve, args=(session,), kwargs={"browser": False, "tell": told.append}
    )
    thread.start()
    while not told:
        time.sleep(0.02)
        assert thread.is_alive()
    address = urlsplit(told[0])
    assert address.port is not None
    running = Server(session, address.port, address.path)
    yield running
    assert running.do({"do": "finish"})[0] == 200
    thread.join(timeout=20)
    assert not thread.is_alive()


def test_the_page_and_all_it_needs_are_served(server: Server) -> None:
    status, text = server.ask(server.path)
    assert status == 200
    asked = re.findall(r'(?:src|href)="([^"]+)"', text.decode())
    for script in (PAGE / "scripts").glob("*.js"):
        asked += [
            f"scripts/{name}" for name in re.findall(r'from "\./([^"]+)"', script.read_text())
        ]
    assert len(set(asked)) > 8
    for name in asked:
        assert server.ask(server.path + name)[0] == 200, name
    assert server.ask(f"{server.path}picture/0")[1][:2] == b"\xff\xd8"
    assert server.ask(f"{server.path}picture/99")[0] == 404
    assert json.loads(server.ask(f"{server.path}state")[1])["film"]["width"] == CLIP.width


def test_nothing_is_kept_and_nothing_comes_from_elsewhere(server: Server) -> None:
    server.ask(server.path)
    assert "default-src 'none'" in server.headers["content-security-policy"]
    assert "unsafe" not in server.headers["content-security-policy"]
    assert server.headers["referrer-policy"] == "no-referrer"
    assert server.headers["cache-control"] == "no-store"


@pytest.mark.parametrize(
    "name", ["", "state", "picture/0", "scripts/main.js", "do", "../", "%2e%2e/"]
)
def test_without_the_token_nothing_is_answered(server: Server, name: str) -> None:
    token = server.path.strip("/")
    for path in (f"/{name}", f"/{token[:-1]}/{name}", f"/{token}x/{name}", f"//{token}/{name}"):
        assert server.ask(path)[0] == 403, path


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "", "0.0.0.0:{port}"]
)
def test_by_another_name_nothing_is_answered(server: Server, host: str) -> None:
    assert server.ask(server.path, Host=host.format(port=server.port))[0] == 403
    assert server.ask(server.path, Host=f"localhost:{server.port}")[0] == 200


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "https://evil.example"}, {"Origin": "null"}, {"Content_Type": "text/plain"}],
)
def test_other_pages_cannot_ask_for_anything(server: Server, headers: dict[str, str]) -> None:
    state = server.session.state
    assert server.do({"do": "polarity", "polarity": "dark"}, **headers)[0] == 403
    assert server.session.state is state


@pytest.mark.parametrize(
    "name",
    [
        "scripts/../index.html", "scripts/../../server.py", "styles/%2e%2e/%2e%2e/server.py",
        "scripts//etc/passwd", "scripts/%2fetc%2fpasswd", "picture/-1", "picture/../state",
        "scripts/..%5c..%5cserver.py",
    ],
)  # fmt: skip
def test_no_other_file_is_read(server: Server, name: str) -> None:
    status, text = server.ask(server.path + name)
    assert status in (403, 404, 307), text[:80]
    assert b"import" not in text


@pytest.mark.parametrize(
    "body", ["", "{", "[]", "7", '{"do": 5}', '{"do": "save", "x": ' + "[" * 5000, "x" * 20_000]
)
def test_what_is_no_event_is_refused_in_words(server: Server, body: str) -> None:
    status, text = server.ask(
        f"{server.path}do", method="POST", body=body, Content_Type="application/json"
    )
    assert status == 400
    assert json.loads(text)["error"]


def test_events_change_the_state_and_errors_come_in_words(server: Server) -> None:
    status, text = server.do({"do": "polarity", "polarity": "dark"})
    assert status == 200
    assert json.loads(text)["polarity"] == "dark"
    status, text = server.do({"do": "track"})
    assert status == 400
    assert "ear, nose" in json.loads(text)["error"]
    assert json.loads(server.do({"do": "undo"})[1])["polarity"] == "auto"
    assert server.ask(f"{server.path}do")[0] == 405
