"""Pages of documentation as a reader meets them: blocks to type, and what they print.

A fence ``sh`` or ``python`` is run, in order, in one folder and one namespace a page. A fence
``text`` after one that was run is what that prints; ``…`` in it stands for anything. Two comments
that readers of the page do not see go before a fence: ``<!-- file: NAME -->`` saves it under that
name instead, and ``<!-- not run: REASON -->`` leaves it out.
"""

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMENT = re.compile(r"<!-- (file|not run): (.*) -->\s*\Z")
ANYTHING = "…"


@dataclass(frozen=True)
class Block:
    """A fence of a page: ``line`` is that of its first line of text."""

    language: str
    text: str
    line: int
    file: str | None = None
    not_run: str | None = None

    @property
    def runs(self) -> bool:
        """Whether a reader is told to type it."""
        return self.language in ("sh", "python") and not (self.file or self.not_run)


def pages() -> list[Path]:
    """Return every page of the site and the README."""
    written = [path for path in (ROOT / "docs").rglob("*.md") if "generated" not in path.parts]
    return [ROOT / "README.md", *sorted(written)]


def blocks(page: Path) -> Iterator[Block]:
    """Yield the fences of a page in order."""
    text = page.read_text(encoding="utf-8")
    for fence in FENCE.finditer(text):
        said = COMMENT.search(text, 0, fence.start())
        comment = {said[1]: said[2]} if said else {}
        line = text.count("\n", 0, fence.start()) + 2
        yield Block(fence[1], fence[2], line, comment.get("file"), comment.get("not run"))


def commands(text: str) -> Iterator[str]:
    """Yield the arguments of every ``drinksim`` command in a shell block."""
    for line in text.replace("\\\n", " ").splitlines():
        yield from re.findall(r"(?:^|[;&|] *|do )drinksim ([^;&|>#]+)", line)


class Reader:
    """Types what a page says, in a folder of its own."""

    def __init__(self, page: Path, folder: Path) -> None:
        self.page, self.folder = page, folder
        self.names: dict[str, object] = {"__name__": "__main__"}
        self.printed: str | None = None

    def read(self) -> None:
        """Run the whole page; AssertionError where it prints something else than the page shows."""
        with contextlib.chdir(self.folder):
            for block in blocks(self.page):
                if block.file:
                    Path(block.file).parent.mkdir(parents=True, exist_ok=True)
                    Path(block.file).write_text(block.text, encoding="utf-8")
                elif block.runs:
                    self.printed = self._type(block)
                elif block.language == "text" and self.printed is not None:
                    where = f"{self.page.relative_to(ROOT)}:{block.line}"
                    assert shows(block.text, self.printed), f"{where} prints\n{self.printed}"

    def _type(self, block: Block) -> str:
        if block.language == "sh":
            return self._shell(block)
        out = io.StringIO()
        # Blank lines before it, so that a traceback names the line of the page.
        code = compile("\n" * (block.line - 1) + block.text, str(self.page), "exec")
        with contextlib.redirect_stdout(out):
            exec(code, self.names)
        return out.getvalue()

    def _shell(self, block: Block) -> str:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block.text],
            env={**os.environ, "PATH": path, "PYTHONPATH": str(ROOT), "COLUMNS": "80"},
            capture_output=True,
            text=True,
            check=False,
        )
        where = f"{self.page.relative_to(ROOT)}:{block.line}"
        assert done.returncode == 0, f"{where} exits with {done.returncode}:\n{done.stderr}"
        return done.stdout


def shows(expected: str, printed: str) -> bool:
    """Whether a page shows what was printed; ``…`` stands for anything.

    >>> shows("a … d", "a b c d"), shows("a", "ab")
    (True, False)
    """
    pattern = ".*?".join(re.escape(piece) for piece in expected.strip().split(ANYTHING))
    return re.fullmatch(pattern, printed.strip(), re.DOTALL) is not None
