"""Mistakes at the terminal are refused or flagged before anything is tracked or computed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.decision_mistakes import DECISIONS
from benchmarks.mistake_list import FILMS, MISTAKES, MOTIONS, NECKS, SCENARIOS, Mistake, Right
from scenarios.cli.main import main

SEEN_IN_THE_FILM = (
    "x and y exchanged",
    "marker off the picture",
    "start after the end of the film",
)
"""Mistakes that only the first used picture shows; `python -m benchmarks.mistakes` types them."""


class WentOnError(Exception):
    """A command went on to track a film or to compute."""


@pytest.fixture(autouse=True)
def nothing_long(monkeypatch: pytest.MonkeyPatch) -> None:
    def went_on(*_: object, **__: object) -> None:
        raise WentOnError

    monkeypatch.setattr("mocap.convert.follow", went_on)
    monkeypatch.setattr("scenarios.sip.replay.Lips", went_on)


def test_the_list_is_long() -> None:
    assert len(MISTAKES) == len(FILMS) + len(MOTIONS) + len(NECKS) + len(SCENARIOS) >= 80
    assert len(DECISIONS) >= 40
    names = {mistake.name for mistake in (*MISTAKES, *DECISIONS)}
    assert len(names) == len(MISTAKES) + len(DECISIONS)


@pytest.mark.slow
@pytest.mark.parametrize(
    "mistake",
    [m for m in (*MISTAKES, *DECISIONS) if m.name not in SEEN_IN_THE_FILM],
    ids=lambda mistake: mistake.name,
)
def test_a_mistake_is_named(
    mistake: Mistake,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = mistake.make(tmp_path)
    try:
        code = main(arguments)
    except WentOnError:
        assert mistake.right is Right.FLAGGED
        code = 0
    except SystemExit as wrong_usage:
        code = int(wrong_usage.code or 0)
    said = capsys.readouterr().err.splitlines()
    assert any(re.search(mistake.says, line) for line in said), said
    assert not any("Traceback" in line for line in said)
    assert "partial" in mistake.says or not any(".partial" in line for line in said)
    if mistake.right is Right.REFUSED:
        assert code == 2
        assert len([line for line in said if not line.startswith("drinksim: warning")]) == 1
    else:
        assert any(line.startswith("drinksim: warning: ") for line in said)
