"""The report in a browser: it fits a telephone and a desk, and shows all of its pictures."""

from pathlib import Path

import pytest

from scenarios.cli.main import main
from tests.support.browser import laid_out
from tests.support.optional import needed_program

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def chromium() -> str:
    return needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")


@pytest.fixture(scope="module")
def page(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("page") / "report.html"
    assert main(["report", str(run_directory), "--out", str(file)]) == 0
    return file


@pytest.mark.parametrize("width_px", [390, 1280])
def test_a_report_fits_the_window(chromium: str, page: Path, width_px: int, tmp_path: Path) -> None:
    found = laid_out(chromium, page, width_px=width_px, scratch=tmp_path)
    assert found.width_px <= width_px
    assert found.height_px > 500
    assert found.pictures > 0
    assert found.broken == 0


def test_what_is_wider_than_the_window_is_noticed(chromium: str, tmp_path: Path) -> None:
    wide = tmp_path / "wide.html"
    wide.write_text('<div style="width: 900px">a</div><img src="data:image/png;base64,AAAA">')
    found = laid_out(chromium, wide, width_px=390, scratch=tmp_path)
    assert (found.width_px, found.pictures, found.broken) == (908, 1, 1)
