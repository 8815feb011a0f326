"""Checksums of what belongs together in a run directory."""

from pathlib import Path

from scenarios.results.integrity import FILES, sealed


def test_what_a_killed_process_left_half_written_does_not_belong_to_a_run(tmp_path: Path) -> None:
    for name in ("history.csv", ".summary.partial-123.json", ".history.partial-123.csv"):
        (tmp_path / name).write_text("x", encoding="utf-8")
    assert list(sealed({}, tmp_path)[FILES]) == ["history.csv"]
