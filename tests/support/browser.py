"""A page as a browser lays it out: how wide it is, and which of its pictures are missing."""

import html
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

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
