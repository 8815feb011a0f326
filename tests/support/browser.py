"""A page as a browser lays it out: how wide it is, and which of its pictures are missing."""

import html
import os
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.support.optional import needed_module

FRAME = """<!doctype html><meta charset="utf-8">
<style>body {{ margin: 0 }} iframe {{ width: {width}px; height: 4000px; border: 0 }}</style>
<iframe srcdoc="{page}"></iframe>
<script>
addEventListener("load", () => {{
  const page = document.querySelector("iframe").contentDocument;
  const told = document.createElement("p");
  const broken = [...page.images].filter(image => !image.complete || image.naturalWidth === 0);
  told.id = "told";
  told.textContent = [
    page.documentElement.scrollWidth, page.body.scrollHeight, page.images.length, broken.length,
  ].join(" ");
  document.body.append(told);
}});
</script>
"""


@dataclass(frozen=True)
class Layout:
    """Extent of a page's content, px, and how many of its pictures there are and are broken."""

    width_px: int
    height_px: int
    pictures: int
    broken: int


def laid_out(browser: str, page: Path, *, width_px: int, scratch: Path) -> Layout:
    """Return how a browser lays out a page.

    The page is put in a frame of this width, since it runs no scripts of its own.
    """
    frame = scratch / f"frame_{width_px}.html"
    text = html.escape(page.read_text(encoding="utf-8"))
    frame.write_text(FRAME.format(width=width_px, page=text), encoding="utf-8")
    options = ["--headless", "--disable-gpu", f"--user-data-dir={scratch / 'profile'}"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        options.append("--no-sandbox")  # Chromium refuses to sandbox what the superuser starts
    done = subprocess.run(
        [browser, *options, "--dump-dom", frame.as_uri()],
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    told = re.search(r'<p id="told">(\d+) (\d+) (\d+) (\d+)</p>', done.stdout)
    assert told, done.stdout[-500:] + done.stderr[-500:]
    return Layout(*map(int, told.groups()))


@dataclass(frozen=True)
class Visit:
    """A page that is open: the tab, what the console said, and the addresses it asked for."""

    tab: Any
    messages: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def ready(self) -> Any:
        """Return the tab when the moving part of a report is there."""
        self.tab.wait_for_selector("#explore[data-ready]", timeout=20_000)
        return self.tab


@contextmanager
def driven(browser: str) -> Iterator[Any]:
    """Start a browser that a test drives."""
    sync = needed_module("playwright.sync_api")
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    options = ["--no-sandbox"] if root else []  # Chromium refuses to sandbox the superuser's
    with sync.sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=browser, args=options)
        yield running
        running.close()


def opened(
    running: Any, page: Path, *, width_px: int = 1280, height_px: int = 900, **context: Any
) -> Visit:
    """Return a page that is open in a new tab."""
    tab = running.new_page(viewport={"width": width_px, "height": height_px}, **context)
    visit = Visit(tab)
    tab.on("console", lambda message: visit.messages.append(message.text))
    tab.on("pageerror", lambda error: visit.messages.append(str(error)))
    tab.on("request", lambda request: visit.requests.append(request.url))
    tab.goto(page.as_uri())
    return visit


def grave_faults(tab: Any) -> list[Any]:
    """Return what axe finds on a page that is worse than minor, and where."""
    axe = needed_module("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(tab).response["violations"]
    grave = [one for one in found if one["impact"] in ("moderate", "serious", "critical")]
    return [(one["id"], [node["target"] for node in one["nodes"]]) for one in grave]
