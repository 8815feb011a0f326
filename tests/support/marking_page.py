"""The marking page of a film, served by the command itself, and a hand on mouse and keyboard."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Served:
    """A command that serves a page: its address, process and exit code after it ended."""

    address: str
    process: subprocess.Popen[str]


@contextmanager
def served(*arguments: str) -> Iterator[Served]:
    """Run ``drinksim mark`` until the block ends, then interrupt it."""
    process = subprocess.Popen(
        [sys.executable, "-m", "drinksim", "mark", *arguments, "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None
    try:
        address = process.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:"), address
        yield Served(address, process)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(timeout=30)
        process.stdout.close()


@dataclass
class Hand:
    """A hand on the mouse, on a page that is open."""

    tab: Any
    foreign: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)

    @classmethod
    def on(cls, running: Any, address: str, *, width_px: int = 1280, height_px: int = 900) -> Hand:
        """Open the page in a new tab."""
        tab = running.new_page(viewport={"width": width_px, "height": height_px})
        hand = cls(tab)
        tab.on("console", lambda message: hand.messages.append(message.text))
        tab.on("pageerror", lambda error: hand.messages.append(str(error)))
        tab.on("request", lambda request: hand._see(request.url, address))
        tab.goto(address)
        tab.wait_for_selector("body[data-ready]", timeout=20_000)
        return hand

    def _see(self, url: str, address: str) -> None:
        if not url.startswith(address):
            self.foreign.append(url)

    def wait(self) -> None:
        """Wait until the page has done what it was asked for."""
        self.tab.wait_for_timeout(80)
        self.tab.wait_for_selector("body:not([data-busy])", timeout=120_000)

    def on_screen(self, at: tuple[float, float]) -> tuple[float, float]:
        """Where a place of the picture, px, is on the screen."""
        canvas = self.tab.locator("#picture")
        box = canvas.bounding_box()
        scale, left, top = (
            float(canvas.get_attribute(f"data-{name}")) for name in ("scale", "left", "top")
        )
        return box["x"] + (at[0] - left) * scale, box["y"] + (at[1] - top) * scale

    def click(self, selector: str, text: str | None = None) -> None:
        """Click on a button with the mouse."""
        self.tab.locator(selector, has_text=text).first.click()
        self.wait()

    def point(self, at: tuple[float, float]) -> None:
        """Click on a place of the picture."""
        self.tab.mouse.click(*self.on_screen(at))
        self.wait()

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> float:
        """Drag from one place of the picture to another; return how long the page took, s."""
        self.tab.mouse.move(*self.on_screen(start))
        self.tab.mouse.down()
        for share in (0.3, 0.7, 1.0):
            at = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
            self.tab.mouse.move(*self.on_screen(at))
        begin = time.monotonic()
        self.tab.mouse.up()
        self.wait()
        return time.monotonic() - begin

    def digits(self, selector: str, text: str) -> None:
        """Enter a number into a field by the keypad on the page."""
        self.tab.locator(selector).click()
        for digit in text:
            self.tab.locator("#keypad button", has_text=digit).first.click()
        self.click("#keypad button", "Set")

    def go_to(self, row: int) -> None:
        """Click on the timeline where a frame is."""
        lane = self.tab.locator(".lane canvas").first
        box, count = lane.bounding_box(), self.frames()
        self.tab.mouse.click(box["x"] + (row + 0.5) / count * box["width"], box["y"] + 6)
        self.tab.wait_for_selector(f"#picture[data-row='{row}']", timeout=10_000)

    def frames(self) -> int:
        """Return the number of frames of the film."""
        return int(self.tab.get_attribute("#time", "max")) + 1

    def error(self) -> str:
        """Return what the page complains about; empty if nothing."""
        box = self.tab.locator("#error")
        return str(box.inner_text()) if box.is_visible() else ""

    def lights(self) -> dict[str, str]:
        """Return the colour of each light."""
        found = self.tab.eval_on_selector_all(
            "#lights li", "all => all.map(one => [one.querySelector('strong').lastChild.data, "
            "one.className])"
        )  # fmt: skip
        return dict(found)
